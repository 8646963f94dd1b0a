"""What comes from outside ends in a value or in one sentence, whatever its size and form."""

import errno
import io
import os
import struct
import zipfile
import zlib

from refusals import book

from calibration.errors import ConfigError, decoding
from calibration.intake.photo import measure_photo
from calibration.study.config.as_data import data_of
from calibration.study.new.grains import sieve_curve
from dem.tables import read_table
from dem.tables.limits import KINDS, MOST_CELLS, MOST_PIXELS, MOST_UNPACKED
from facts import holds, refused, tells


def saved(path, *sheets, **options):
    """A workbook of the sheets."""
    book(*sheets, **options)(path)
    return path


def test_a_workbook_that_unpacks_to_more_than_a_table_is_not_unpacked(tmp_path):
    source = zipfile.ZipFile(saved(tmp_path / "a.xlsx", [["value"], [1.0]]))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as target:
        for part in source.infolist():
            big = b" " * (MOST_UNPACKED + 1) if "sheet1" in part.filename else b""
            target.writestr(part.filename, source.read(part) + big)
    (tmp_path / "b.xlsx").write_bytes(packed.getvalue())
    with refused(ConfigError, "24 MB", path="b.xlsx"):
        read_table(tmp_path / "b.xlsx")


def test_a_table_of_more_cells_than_any_is_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("a,b,c,d,e\n" + "1,2,3,4,5\n" * (MOST_CELLS // 5))
    with refused(ConfigError, "5 columns", path="a.csv"):
        read_table(path)


def test_a_file_larger_than_its_kind_is_refused(tmp_path):
    with open(tmp_path / "a.csv", "wb") as stream:
        stream.truncate(KINDS["table"].most + 1)
    with refused(ConfigError, "16 MB", path="a.csv"):
        read_table(tmp_path / "a.csv")


def test_a_picture_of_more_pixels_than_are_read_is_not_decoded(tmp_path):
    for name, side in (("a.png", 9000), ("b.png", 20000)):  # the second one stops the library
        assert side * side > MOST_PIXELS
        parts = (b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)), (b"IDAT", b"")
        chunks = [
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
            for kind, data in parts
        ]
        (tmp_path / name).write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
        with refused(ConfigError, "64 million", path=name):
            measure_photo(tmp_path / name)


def test_a_file_that_may_not_be_read_is_not_told_to_be_damaged():
    with refused(ConfigError, "Permission denied", path="a.wav") as caught, decoding("a.wav", ""):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), "a.wav")
    assert not holds(str(caught.value), "damaged")


def test_a_configuration_without_end_is_not_read_to_its_end():
    with refused(ConfigError, "262,144 characters"):
        data_of(io.StringIO("a" * (1 << 20)))


def test_workbooks_as_people_have_them(tmp_path):
    titled = [["Versuch Weizen"], ["Nr", "Winkel in °"], [1, 26.1], [2, 27.4]]
    table = read_table(saved(tmp_path / "a.xlsx", titled))
    assert (table.header, table.header_line) == (("Nr", "Winkel"), 2)
    assert table.units == {"Winkel": "°"}
    assert tells(table.how, "line 1", "title")
    rows = [["experiment", "value"], ["heap", 26.1], [None, 27.4], ["drop", 3.0]]
    merged = read_table(saved(tmp_path / "b.xlsx", rows, merge=["A2:A3"]))
    assert [row["experiment"] for _, row in merged.rows] == ["heap", "heap", "drop"]
    rows = [["experiment", "value"], ["heap", 26.1], ["heap", None]]
    with refused(ConfigError, "26.1", line=2):
        read_table(saved(tmp_path / "c.xlsx", rows, merge=["B2:B3"]))
    with refused(ConfigError, "grad", "gon"):
        read_table(saved(tmp_path / "d.xlsx", [["Nr", "Winkel in grad"], [1, 2]]))


def test_sieve_tables_have_german_and_french_headings(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("diameter_mm,passing_percent\n1,0\n2,40\n4,100\n")
    expected = sieve_curve(path)
    path.write_text("Maschenweite [mm];Siebdurchgang [%]\n1;0\n2;40\n4;100\n")
    assert sieve_curve(path) == expected
    path.write_text("maille en mm;passant en %\n1;0\n2;40\n4;100\n")
    assert sieve_curve(path) == expected
    path.write_text("Maschenweite;Siebdurchgang [%]\n1;0\n2;40\n4;100\n")
    with refused(ConfigError, "Maschenweite", "mm", line=1):
        sieve_curve(path)
