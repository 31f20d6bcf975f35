"""Readers of reflectance give back what was written, in SI units, and refuse what is no measurement with one line that says why."""

import os
import tracemalloc

import fit_data
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ggxref.errors import InputError
from ggxref.fit.data import Reflectance
from ggxref.fit.readers import merl, read, rgl

DEGREES = fit_data.plane_angles((30.0,))[::10]
VALUES = 0.1 + 0.01 * np.arange(len(DEGREES))
ROW = "30 180 -85 0 "


def lines(*extra):
    return fit_data.table(DEGREES, VALUES) + "".join(f"{line}\n" for line in extra)


class TestTable:
    def test_directions_and_values(self, tmp_path):
        data = read(fit_data.write(tmp_path / "a.csv", fit_data.table(DEGREES, VALUES)))
        assert isinstance(data, Reflectance)
        # azimuth_i = 180 degrees, so that a positive zenith_o, at azimuth 0, is the mirror's side.
        assert_allclose(data.wi, np.tile([-0.5, 0, np.sqrt(0.75)], (len(VALUES), 1)), atol=1e-15)
        assert_allclose(data.wo[:, 0], np.sin(np.radians(DEGREES[:, 2])), rtol=1e-14)
        assert_array_equal(data.values[:, 0], VALUES)
        assert data.bands == ("brdf",) and data.mask.all()

    @pytest.mark.parametrize("name", ["a.x3p", "a", "a.npy"])
    def test_format_is_recognised_by_content(self, tmp_path, name):
        assert isinstance(read(fit_data.write(tmp_path / name, fit_data.table(DEGREES, VALUES))), Reflectance)

    def test_named_columns_in_any_order(self, tmp_path):
        rows = "\n".join(
            f"{v:.17g},{a[2]},{a[3]},{a[0]},{a[1]},{2 * v:.17g}" for a, v in zip(DEGREES, VALUES, strict=True)
        )
        text = "red,zenith_o,azimuth_o,zenith_i,azimuth_i,green\n" + rows
        data = read(fit_data.write(tmp_path / "a.csv", text))
        plain = read(fit_data.write(tmp_path / "b.csv", fit_data.table(DEGREES, VALUES)))
        assert isinstance(data, Reflectance) and isinstance(plain, Reflectance)
        assert data.bands == ("red", "green")
        assert_array_equal(data.values, np.stack([VALUES, 2 * VALUES], axis=1))
        assert_array_equal(data.wo, plain.wo)

    def test_other_names_leave_the_order(self, tmp_path):
        text = fit_data.table(DEGREES, VALUES, "# Data from X\n# phi_in theta_in phi_out theta_out brdf\n")
        data = read(fit_data.write(tmp_path / "a.csv", text))
        assert isinstance(data, Reflectance)
        assert_allclose(data.wi[0], [-0.5, 0, np.sqrt(0.75)], atol=1e-15)

    def test_the_horizon_is_left_out_and_counted(self, tmp_path):
        data = read(fit_data.write(tmp_path / "a.csv", lines("30 180 90 0 0.1", "30 180 -90 0 0.1")))
        assert isinstance(data, Reflectance)
        assert data.counts == {"left out: on the horizon": 2}
        assert data.mask.sum() == len(VALUES)

    @pytest.mark.parametrize(
        ("line", "said"),
        [
            (ROW + "nan", "line 20: brdf = nan; a BRDF is finite"),
            (ROW + "inf", "line 20: brdf = inf"),
            (ROW + "-0.1", "line 20: brdf = -0.1; a BRDF is finite and not negative"),
            ("30 180 93.2 0 0.1", "line 20: zenith_o = 93.2 is below the horizon"),
            ("-91 180 0 0 0.1", "line 20: zenith_i = -91 is below the horizon"),
            ("30 180 nan 0 0.1", "line 20: zenith_o = nan"),
            ("30 400 0 0 0.1", "line 20: azimuth_i = 400 is no azimuth; need -360 to 360 degrees"),
            (ROW + "x", "line 20: could not convert string to float: 'x'"),
            (ROW, "line 20: 4 columns where the rows above have 5"),
        ],
    )
    def test_a_bad_line_is_named(self, tmp_path, line, said):
        with pytest.raises(InputError, match=said) as error:
            read(fit_data.write(tmp_path / "a.csv", lines(line)))
        assert "\n" not in str(error.value) and str(tmp_path / "a.csv") in str(error.value)

    def test_radians_are_noticed(self, tmp_path):
        with pytest.raises(InputError, match="look like radians; need degrees"):
            read(fit_data.write(tmp_path / "a.csv", fit_data.table(np.radians(DEGREES), VALUES)))

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("", "the file is empty"),
            ("Dear reader,\nthis is a letter and no measurement at all.\n", "no measurement known here"),
            ("1 2 3\n" * 20, "no measurement known here"),
            (lines()[: len(fit_data.HEADER) + 120], "rows of numbers"),
            (fit_data.table(DEGREES, 0 * VALUES), "brdf is 0 in every row"),
            (b"\x00\x01\x02" * 50, "no measurement known here"),
            (fit_data.table(DEGREES, VALUES).encode() + b"\xff\xfe\n", "not UTF-8 text"),
        ],
    )
    def test_no_table(self, tmp_path, text, said):
        with pytest.raises(InputError, match=said):
            read(fit_data.write(tmp_path / "a.csv", text))


class TestRgl:
    def test_a_matte_material_comes_back(self, tmp_path):
        """Through the warp, D, σ and the cosine to the same f everywhere above the horizon."""
        data = read(fit_data.write(tmp_path / "a", fit_data.tensor_file(fit_data.rgl_fields())))
        assert isinstance(data, Reflectance)
        assert data.bands == ("r", "g", "b") and data.source.format == "rgl"
        assert data.mask.sum() > 100
        assert_allclose(data.values[data.mask], np.tile([0.1, 0.2, 0.3], (data.mask.sum(), 1)), rtol=1e-5)
        assert_allclose(np.linalg.norm(data.wo, axis=1), 1, rtol=1e-12)

    def test_what_is_left_out_is_counted(self, tmp_path):
        data = read(fit_data.write(tmp_path / "a", fit_data.tensor_file(fit_data.rgl_fields())))
        assert isinstance(data, Reflectance)
        assert data.counts["left out: incident zenith from 80° on"] == 81
        assert data.counts["left out: below the horizon"] == (data.wo[:243, 2] <= 0).sum() > 0
        assert not data.mask[243:].any() and data.mask.sum() == (data.wo[:243, 2] > 0).sum()

    def test_the_warp_is_the_inverse_of_the_cumulative(self):
        """Shares of a density that varies in both axes, against a fine sum over its bilinear interpolation."""
        density = 1 + np.random.default_rng(0).random((5, 7))
        share_x, share_y = np.array([0.2, 0.7]), np.array([0.35, 0.9])
        x, y = rgl.invert(density, share_x, share_y)
        fine = (np.arange(2000) + 0.5) / 2000
        table = rgl.bilinear(density, *(axis.ravel() for axis in np.meshgrid(fine, fine))).reshape(2000, 2000)
        for k in range(2):
            assert table[fine < y[k]].sum() / table.sum() == pytest.approx(share_y[k], abs=1e-3)
            row = rgl.bilinear(density, fine, np.full_like(fine, y[k]))
            assert row[fine < x[k]].sum() / row.sum() == pytest.approx(share_x[k], abs=1e-3)

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (lambda f: f.pop("vndf"), "field 'vndf' is missing"),
            (lambda f: f.update(rgb=f["rgb"][0]), "field 'rgb' has shape"),
            (lambda f: f.update(rgb=f["rgb"][:, :2]), "does not fit"),
            (lambda f: f.update(rgb=f["rgb"] * np.float32(np.nan)), "is not finite"),
        ],
    )
    def test_fields_that_do_not_fit(self, tmp_path, change, said):
        fields = fit_data.rgl_fields()
        change(fields)
        with pytest.raises(InputError, match=said):
            read(fit_data.write(tmp_path / "a", fit_data.tensor_file(fields)))

    def test_memory_is_of_the_files_size(self, tmp_path):
        """A fine grid of values under a long row of `vndf`: a table of both would have the file's size squared."""
        fields = fit_data.rgl_fields(theta_i=(0.0,), grid=150) | {"vndf": np.ones((1, 1, 2, 60_000), "f4")}
        path = fit_data.write(tmp_path / "a", fit_data.tensor_file(fields))
        tracemalloc.start()
        read(path)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most < 40 * path.stat().st_size

    def test_a_name_as_long_as_the_file_is_not_repeated(self, tmp_path):
        content = fit_data.tensor_file({"n" * 60_000: np.zeros(1, "f4")}).replace(b"\x01\x00\n", b"\xff\xff\n")
        with pytest.raises(InputError, match="has type 10 and 65535 dimensions; need") as caught:
            read(fit_data.write(tmp_path / "a", content))
        assert len(str(caught.value)) < 1100

    @pytest.mark.parametrize("length", [13, 20, 60, 5000])
    def test_truncated(self, tmp_path, length):
        with pytest.raises(InputError, match=r"truncated|ends beyond"):
            read(fit_data.write(tmp_path / "a", fit_data.tensor_file(fit_data.rgl_fields())[:length]))

    def test_an_absurd_size_takes_no_memory(self, tmp_path):
        content = bytearray(fit_data.tensor_file(fit_data.rgl_fields()))
        at = content.index(b"phi_i") + 5 + 2 + 1 + 8
        content[at : at + 8] = (2**60).to_bytes(8, "little")
        with pytest.raises(InputError, match="ends beyond the file"):
            read(fit_data.write(tmp_path / "a", bytes(content)))


class TestMerl:
    def test_the_true_size_comes_back(self, tmp_path):
        values = np.random.default_rng(0).random((3, 90 * 90 * 180))
        path = fit_data.write(tmp_path / "a", fit_data.merl(values))
        assert path.stat().st_size == 34_992_012
        data = read(path)
        assert isinstance(data, Reflectance) and data.bands == ("r", "g", "b")
        assert_allclose(data.values, values.T, rtol=1e-14)

    def test_directions_have_their_half_and_difference_angles(self):
        wi, wo = merl.directions((6, 5, 4))
        half = wi + wo
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        expected = (np.arange(6) / 6) ** 2 * np.pi / 2
        assert_allclose(
            np.arccos(np.clip(half[:, 2], -1, 1)).reshape(6, -1), expected[:, None] * np.ones(20), atol=1e-7
        )
        difference = np.arccos(np.clip((half * wi).sum(axis=1), -1, 1)).reshape(6, 5, 4)
        assert_allclose(difference, np.broadcast_to((np.arange(5) / 5 * np.pi / 2)[:, None], (6, 5, 4)), atol=1e-7)
        assert_allclose(np.linalg.norm(wi, axis=1), 1, rtol=1e-12)

    def test_missing_values_are_left_out(self, tmp_path):
        data = read(fit_data.write(tmp_path / "a", fit_data.merl((-1.0, 0.2, 0.3), (6, 5, 4))))
        assert isinstance(data, Reflectance)
        assert not data.mask.any() and data.counts["left out: missing (negative)"] > 0

    def test_truncated(self, tmp_path):
        with pytest.raises(InputError, match="the file is truncated"):
            read(fit_data.write(tmp_path / "a", fit_data.merl((0.1, 0.2, 0.3))[:-8]))


class TestAstm:
    TEXT = "VERSION 1.0\nSAMPLE metal\nVARS theta_i,phi_i,theta_s,phi_s,633nm,nir\n" + "".join(
        f"0.5236,3.14159,{zenith:.4f},0.0,{0.1 + zenith:.4f},0.5\n" for zenith in np.linspace(0, 1.5708, 12)
    )

    def test_radians_and_bands(self, tmp_path):
        data = read(fit_data.write(tmp_path / "a", self.TEXT))
        assert isinstance(data, Reflectance)
        assert data.bands == ("633nm", "nir") and data.source.format == "astm"
        assert_allclose(data.wi[0], [-0.5, 0, np.sqrt(0.75)], atol=1e-5)
        assert_allclose(data.values[0], [0.1, 0.5])
        assert data.counts == {"left out: on the horizon": 1}

    def test_degrees_are_noticed(self, tmp_path):
        head, rows = self.TEXT[: self.TEXT.index("0.5236")], fit_data.table(DEGREES, VALUES, "").replace(" ", ",")
        with pytest.raises(InputError, match=r"zeniths up to 85 and azimuths up to 180: these look like degrees"):
            read(fit_data.write(tmp_path / "a", head.replace(",nir", "") + rows))

    def test_one_zenith_beyond_a_right_angle_is_a_bad_line(self, tmp_path):
        with pytest.raises(
            InputError, match=r"line 15: zenith_o = 30 is below the horizon; need -1.571 to 1.571 radians"
        ):
            read(fit_data.write(tmp_path / "a", self.TEXT.replace("1.5708,0.0", "30.0,0.0")))

    def test_negative_values_are_named(self, tmp_path):
        with pytest.raises(InputError, match=r"line 4: 633nm = -0.1"):
            read(fit_data.write(tmp_path / "a", self.TEXT.replace(",0.1000,0.5", ",-0.1,0.5", 1)))


class TestPath:
    def test_no_such_file(self, tmp_path):
        with pytest.raises(InputError, match="no such file"):
            read(tmp_path / "nothing.csv")

    def test_a_directory(self, tmp_path):
        with pytest.raises(InputError, match="not a regular file"):
            read(tmp_path)

    def test_a_pipe_does_not_block(self, tmp_path):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(InputError, match="not a regular file"):
            read(tmp_path / "pipe")
