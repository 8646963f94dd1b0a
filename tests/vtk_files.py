"""PolyData files as VTK describes them (VTK XML formats: compressed blocks, base64), read without
the project's code."""

import base64
import zlib
from xml.etree import ElementTree

import numpy as np

HEADER = {"UInt64": "u8", "UInt32": "u4"}
VALUES = {"Float64": "f8", "Float32": "f4", "Int64": "i8"}


def read_vtp(path):
    """{name: array} of a .vtp file: the data of its points, `Points`, and ends of cells."""
    root = ElementTree.parse(path).getroot()
    assert (root.get("type"), root.get("byte_order")) == ("PolyData", "LittleEndian")
    assert root.get("compressor") == "vtkZLibDataCompressor"
    [piece] = root.findall("PolyData/Piece")
    count = np.dtype("<" + HEADER[root.get("header_type")])
    found = {a.get("Name"): _values(a, count) for a in piece.find("PointData")}
    found["Points"] = _values(piece.find("Points/DataArray"), count)
    assert len(found["Points"]) == int(piece.get("NumberOfPoints"))
    for cells in ("Verts", "Polys"):
        arrays = {a.get("Name"): _values(a, count) for a in piece.find(cells)}
        assert len(arrays["offsets"]) == int(piece.get(f"NumberOf{cells}"))
        assert len(arrays["connectivity"]) == (arrays["offsets"][-1:].sum())
        found[cells] = arrays["offsets"]
    return found


def _values(element, count):
    """Values of a DataArray: a header of counts in base64, then all blocks in base64."""
    text = element.text
    blocks = int(np.frombuffer(base64.b64decode(text[:12])[: count.itemsize], count)[0])
    if not blocks:
        data = b""
    else:
        size = -(-(3 + blocks) * count.itemsize // 3) * 4
        _, whole, last, *packed = np.frombuffer(base64.b64decode(text[:size]), count).tolist()
        rest, data = base64.b64decode(text[size:]), b""
        for length in packed:
            data, rest = data + zlib.decompress(rest[:length]), rest[length:]
        assert len(data) == (blocks - 1) * whole + (last or whole)
        assert not rest
    values = np.frombuffer(data, "<" + VALUES[element.get("type")])
    width = element.get("NumberOfComponents")
    return values.reshape(-1, int(width)) if width else values
