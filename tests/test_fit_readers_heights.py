"""Readers of height fields give back what was written, in metres, and refuse what is none with one line that says why."""

import io
import zipfile

import fit_data
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ggxref.errors import InputError
from ggxref.fit.data import Heights
from ggxref.fit.readers import read, x3p

SURFACE = fit_data.rough_surface(24)


class TestHeights:
    @pytest.mark.parametrize(
        ("code", "unit", "accuracy"), [("D", 1, 0), ("F", 1, 1e-7), ("L", 1e-12, 1e-5), ("I", 1e-10, 1e-3)]
    )
    def test_x3p(self, tmp_path, code, unit, accuracy):
        field = read(fit_data.write(tmp_path / "a", fit_data.x3p(SURFACE / unit, code, unit)))
        assert isinstance(field, Heights)
        assert field.pixel == (1e-6, 2e-6)
        assert_allclose(field.heights, SURFACE, rtol=0, atol=accuracy * 1e-6)

    def test_matrix(self, tmp_path):
        field = read(fit_data.write(tmp_path / "a", fit_data.matrix(SURFACE * 1e9)))
        assert isinstance(field, Heights)
        assert field.pixel == (1e-6, 1e-6)
        assert_allclose(field.heights, SURFACE, rtol=1e-8)

    def test_npy_and_the_pixel_that_the_user_gives(self, tmp_path):
        field = read(fit_data.write(tmp_path / "a", fit_data.npy(SURFACE)), pixel=(1e-6, 3e-6))
        assert isinstance(field, Heights)
        assert field.pixel == (1e-6, 3e-6)
        assert_array_equal(field.heights, SURFACE)

    def test_the_users_pixel_wins(self, tmp_path):
        field = read(fit_data.write(tmp_path / "a", fit_data.matrix(SURFACE)), pixel=(2e-6, 2e-6))
        assert isinstance(field, Heights) and field.pixel == (2e-6, 2e-6)

    def test_missing_heights_are_nan(self, tmp_path):
        holes = SURFACE.copy()
        holes[3, 4], holes[5, 6], holes[7, 8] = np.nan, 1e300, -1e300
        field = read(fit_data.write(tmp_path / "a", fit_data.x3p(holes)))
        assert isinstance(field, Heights)
        assert np.argwhere(np.isnan(field.heights)).tolist() == [[3, 4], [5, 6], [7, 8]]

    @pytest.mark.parametrize(
        ("content", "said"),
        [
            (fit_data.x3p(SURFACE)[:900], "broken or truncated zip"),
            (fit_data.x3p(SURFACE, nx=2**40), "bytes where"),
            (fit_data.x3p(SURFACE, nx=0), "need 3 or more a side"),
            (fit_data.x3p(SURFACE, nx=-24), "need 3 or more a side"),
            (fit_data.x3p(SURFACE, nz=2), "one layer"),
            (fit_data.x3p(SURFACE, nx="many"), "need int"),
            (fit_data.x3p(SURFACE, dx=0), "pixel size dx = 0 m"),
            (fit_data.x3p(SURFACE, dy="nan"), "pixel size dy = nan m"),
            (fit_data.x3p(SURFACE, dy=2), "pixel size dy = 2 m"),
            (fit_data.x3p(SURFACE * 0, "L", 0.0), "z increment = 0"),
            (
                fit_data.x3p(SURFACE, main=fit_data.MAIN.replace("<CZ>", "<C>").replace("</CZ>", "</C>")),
                "no Record1/Axes/CZ",
            ),
            (fit_data.x3p(SURFACE, main=fit_data.MAIN.replace("{code}", "Q")), "heights of type 'Q'"),
            (fit_data.x3p(SURFACE, main="<a><b></a>"), "main.xml: mismatched tag"),
            (fit_data.x3p(SURFACE, main="no xml"), "main.xml: syntax error"),
            (fit_data.npy(SURFACE)[:-8], "bytes of data where"),
            (fit_data.npy(SURFACE)[:40], "broken .npy header"),
            (fit_data.npy(SURFACE.ravel()), "need two dimensions"),
            (fit_data.npy(SURFACE.astype(complex)), "of real numbers"),
            (fit_data.npy(np.array([[{}] * 4] * 4, dtype=object)), "of real numbers"),
            (fit_data.matrix(SURFACE, pixel="0 m"), "pixel size dx = 0 m"),
            (fit_data.matrix(SURFACE, pixel="-1e-6 m"), "pixel size dx = -1e-06 m"),
            (fit_data.matrix(SURFACE, pixel="0.37 um"), "pixel size in 'um'; need m"),
            (fit_data.matrix(SURFACE, factor="0"), "height conversion factor = 0"),
            (fit_data.matrix(SURFACE, size="h=99999 w=99999"), "a matrix of 99999 x 99999"),
            (fit_data.matrix(SURFACE, size="h=24 w=25"), "576 numbers where 24 x 25 = 600"),
            (fit_data.matrix(SURFACE).replace(" 1", " one", 1), "could not convert string to float"),
        ],
    )
    def test_broken_files(self, tmp_path, content, said):
        pixel = (1e-6, 1e-6) if not isinstance(content, str) and content.startswith(b"\x93") else None
        with pytest.raises(InputError, match=said) as error:
            read(fit_data.write(tmp_path / "a", content), pixel=pixel)
        assert "\n" not in str(error.value)

    def test_the_pixel_size_must_be_known(self, tmp_path):
        with pytest.raises(InputError, match="does not say its pixel size"):
            read(fit_data.write(tmp_path / "a", fit_data.npy(SURFACE)))

    def test_entities_are_refused(self, tmp_path):
        bomb = '<!DOCTYPE a [<!ENTITY b "' + "b" * 100 + '"><!ENTITY c "' + "&b;" * 100 + '">]><a>&c;</a>'
        with pytest.raises(InputError, match="declares a document type"):
            read(fit_data.write(tmp_path / "a", fit_data.x3p(SURFACE, main=bomb)))

    def test_a_zip_bomb_is_refused_before_it_is_unpacked(self, tmp_path, monkeypatch):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("main.xml", b" " * (x3p.LARGEST_XML + 1))

        def unpack(*_):
            raise AssertionError("unpacked")

        monkeypatch.setattr(zipfile.ZipFile, "open", unpack)
        with pytest.raises(InputError, match="too large to be true"):
            read(fit_data.write(tmp_path / "a", stream.getvalue()))

    def test_a_member_longer_than_it_claims_is_refused(self, tmp_path):
        content = bytearray(fit_data.x3p(SURFACE))
        at = content.rfind(b"bindata/data.bin") - 46  # the central directory's entry
        claimed = int.from_bytes(content[at + 24 : at + 28], "little")
        assert claimed == SURFACE.nbytes
        content[at + 24 : at + 28] = (claimed - 8).to_bytes(4, "little")
        with pytest.raises(InputError, match="bytes"):
            read(fit_data.write(tmp_path / "a", bytes(content)))
