"""Property: a file is there whole or not at all, and a failed write leaves nothing behind."""

import os

import pytest

from ggxref import files
from ggxref.errors import InputError


def test_it_replaces_a_file_and_leaves_no_other(tmp_path):
    path = tmp_path / "a.json"
    files.write_atomically(path, "old")
    files.write_atomically(path, b"new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_its_permissions_are_those_of_a_plain_file(tmp_path):
    files.write_atomically(tmp_path / "a", "")
    (tmp_path / "b").write_text("")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_an_interrupted_write_keeps_the_old_file_and_removes_the_new(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    path.write_text("old")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        files.write_atomically(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_directory_that_cannot_be_is_refused_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "none" / "here"):
        with pytest.raises(InputError, match=f"--out: {path} cannot be written"):
            files.writable_directory("--out", path)
    for path in (None, tmp_path, tmp_path / "new"):
        files.writable_directory("--out", path)
