"""Arrays and metadata of safetensors files."""

import json
import struct

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine

TYPES = ["float32", "float64", "uint8", "int32", "int64", "uint64"]


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("shape", [(), (0, 3), (2, 3)])
def test_arrays_come_back_as_they_were_added(dtype, shape, tmp_path):
    array = np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(dtype)
    file = engine.SafetensorsFile()
    file.add("a", array)
    file.write(tmp_path / "file")
    array[...] = 7  # the file has a copy
    again = engine.SafetensorsFile.read(tmp_path / "file").get("a")
    assert again.dtype == dtype and again.shape == shape
    np.testing.assert_array_equal(again.ravel(), np.arange(again.size))


def test_arrays_of_any_layout_are_copied_in_row_major_order():
    array, file = np.arange(12.0).reshape(3, 4), engine.SafetensorsFile()
    file.add("transposed", array.T)
    file.add("strided", array[:, ::2])
    np.testing.assert_array_equal(file.get("transposed"), array.T)
    np.testing.assert_array_equal(file.get("strided"), array[:, ::2])
    file.get("strided")[:] = 0  # a copy
    assert file.get("strided").any()


def test_metadata_is_kept(tmp_path):
    file = engine.SafetensorsFile()
    file.set_metadata("made by", "first")
    file.set_metadata("made by", "a test")
    file.metadata["other"] = "a copy has no effect"
    file.write(tmp_path / "file")
    assert engine.SafetensorsFile.read(tmp_path / "file").metadata == {"made by": "a test"}


@pytest.mark.parametrize("dtype, stored, want", [
    ("F16", np.array([1.5, -2], "float16"), np.array([1.5, -2], "float16")),
    ("BF16", np.array([0x3fc0, 0xc000], "uint16"), np.array([1.5, -2], "float32")),
    ("I8", np.array([-1, 5], "int8"), np.array([-1, 5], "int8")),
    ("U32", np.array([1, 2 ** 31], "uint32"), np.array([1, 2 ** 31], "uint32")),
    ("BOOL", np.array([1, 0], "uint8"), np.array([True, False]))])
def test_arrays_of_other_programs_are_read(dtype, stored, want, tmp_path):
    header = json.dumps({"a": {"dtype": dtype, "shape": [2], "data_offsets": [0, stored.nbytes]}}).encode()
    (tmp_path / "file").write_bytes(struct.pack("<Q", len(header)) + header + stored.tobytes())
    got = engine.SafetensorsFile.read(tmp_path / "file").get("a")
    assert got.dtype == want.dtype
    np.testing.assert_array_equal(got, want)


def test_a_type_that_numpy_lacks_is_refused(tmp_path):
    header = json.dumps({"a": {"dtype": "F8_E5M2", "shape": [2], "data_offsets": [0, 2]}}).encode()
    (tmp_path / "file").write_bytes(struct.pack("<Q", len(header)) + header + b"xx")
    with pytest.raises(fm.IoError, match=r"^\[SafetensorsFile.get\] array 'a' must have a type .*, got F8_E5M2"):
        engine.SafetensorsFile.read(tmp_path / "file").get("a")


def test_names_and_arrays_that_do_not_fit_are_refused():
    file = engine.SafetensorsFile()
    file.add("a", np.ones(2))
    for call, error, text in (
            (lambda: file.get("b"), fm.IoError, "b.*a"),
            (lambda: file.get(3), TypeError, r"^\[SafetensorsFile.get\] name must be text, got int"),
            (lambda: file.add("a", np.ones(2)), ValueError, "a"),
            (lambda: file.add("__metadata__", np.ones(2)), ValueError, "__metadata__"),
            (lambda: file.add("b", [1.0]), TypeError, r"^\[SafetensorsFile.add: array\] must be a numpy array, got list"),
            (lambda: file.add("b", np.ones(2, "float16")), TypeError, r"must be of float32, .* or uint64, got float16"),
            (lambda: file.add("b", np.ones(2, ">f8")), TypeError, r"got >f8"),
            (lambda: file.add("b", np.ma.masked_array(np.ones(2), True)), TypeError, "must not be masked"),
            (lambda: file.add("b", np.ones((1,) * 6)), fm.ShapeError, "5"),
            (lambda: file.set_metadata("key", 3), TypeError,
             r"^\[SafetensorsFile.set_metadata\] text must be text, got int")):
        with pytest.raises(error, match=text):
            call()
    assert file.names() == ["a"] and file.metadata == {}
