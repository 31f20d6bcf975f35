"""Which form to use in which dtype, read off the pareto table."""

from ggxref.measure.charts import front
from ggxref.measure.tables import Rows

DTYPES = {"f64": 2.0**-29, "f32": 1.0, "f16": 2.0**13, "bf16": 2.0**16}


def table(rows: Rows) -> str:
    """Markdown: for each quantity the forms on the front, and how much of each dtype's precision the library's keeps."""
    lines = [
        "| quantity | most accurate float32 form (largest error, time) | fastest float32 form within 16 ULP |"
        " the library's form elsewhere: largest error in the dtype's own ULPs |",
        "|---|---|---|---|",
    ]
    for name in dict.fromkeys(r["quantity"] for r in rows):
        mine = [r for r in rows if r["quantity"] == name]
        single = [r for r in mine if r["dtype"] == "f32" and not r["approximate"]]
        best = min(single, key=lambda r: r["worst"])
        good = [r for r in front(single) if r["worst"] <= 16]
        other = ", ".join(f"{r['dtype']} {r['worst'] / DTYPES[r['dtype']]:.3g}" for r in mine if r["dtype"] != "f32")
        fast = f"{good[0]['variant']} ({good[0]['ns']:.2g} ns)" if good else "none"
        lines.append(
            f"| {name} | {best['variant']} ({best['worst']:.3g} ULP, {best['ns']:.2g} ns) | {fast} | {other} |"
        )
    return "\n".join(lines) + "\n"
