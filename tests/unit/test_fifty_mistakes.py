"""Fifty mistaken inputs of `dem new`, as a stranger makes them: each is refused with the place and
what would be right, and nothing is left behind."""

import shlex
from pathlib import Path

import pytest

from calibration.interface.commands import main
from facts import holds

GRAIN = "--density 1.32g/cm3 --grain 4mm"
ANGLE = "--lifted-cylinder 26.1 27.4 28.0 cylinder=60mm depth=80mm"
RIG = "--orifice 25mm --plate 100mm --height 75mm"
FUNNEL = "--funnel 26 27 orifice=25mm plate=100mm height=75mm"
CYLINDER, POWDER = "--lifted-cylinder 26.1 27", "--density 2.7g/cm3 --grain 50um"

OPTIONS = {
    "no folder": (f"new {GRAIN} {ANGLE}", ["folder", "dem new FOLDER"]),
    "a folder that is there": (f"new taken {GRAIN} {ANGLE}", ["taken", "exists"]),
    "no density": (f"new w --grain 4mm {ANGLE}", ["--density", "1.32 g/cm3"]),
    "no size": (f"new w --density 1.32g/cm3 {ANGLE}", ["size", "--grain", "--axes", "--sieve"]),
    "no test": (f"new w {GRAIN}", ["--measured", "dem new --help"]),
    "a value and its unit apart": (f"new w --density 1.32g/cm3 --grain 4 cm {ANGLE}",
                                   ["cm", "one word", "4mm"]),
    "a bare density in g/cm3": (f"new w --density 1.32 --grain 4mm {ANGLE}",
                                ["--density", "1.32 g/cm³"]),
    "a mass for a density": (f"new w --density 1.32g --grain 4mm {ANGLE}",
                             ["--density", "1.32g", "kg/m³"]),
    "words for a number": (f"new w --density heavy --grain 4mm {ANGLE}", ["--density", "heavy"]),
    "a negative density": (f"new w --density=-1320kg/m3 --grain 4mm {ANGLE}",
                           ["--density", "more than 0"]),
    "a grain of nothing": (f"new w --density 1.32g/cm3 --grain 0 {ANGLE}", ["--grain", "0"]),
    "a range of sizes": (f"new w --density 1.32g/cm3 --grain 3-5mm {ANGLE}",
                         ["--grain", "3-5mm", "range", "sieve"]),
    "two sizes": (f"new w {GRAIN} --axes 6.2x3.3x2.9mm {ANGLE}", ["axes", "diameter", "one of"]),
    "a mean with its spread": (f"new w {GRAIN} --lifted-cylinder '26.1±0.8'",
                               ["26.1±0.8", "sd=0.8", "n"]),
    "the same in words": (f"new w {GRAIN} --lifted-cylinder 26.1 +/- 0.8", ["+/-", "sd=0.8"]),
    "a lost point": (f"new w {GRAIN} --lifted-cylinder 26.1 284", ["284", "28.4 °"]),
    "radians": (f"new w {GRAIN} --lifted-cylinder 0.46 0.48", ["0.46", "0.46 rad"]),
    "not a number": (f"new w {GRAIN} --lifted-cylinder NaN 27", ["NaN", "number in deg"]),
    "one reading": (f"new w {GRAIN} --lifted-cylinder 26.1", ["26.1", "second reading", "sd"]),
    "readings and a spread": (f"new w {GRAIN} {CYLINDER} sd=0.8 n=5", ["sd=0.8", "one mean"]),
    "n of nothing": (f"new w {GRAIN} --lifted-cylinder 26.1 sd=0.8 n=0", ["n=0", "whole number"]),
    "half a reading": (f"new w {GRAIN} --lifted-cylinder 26.1 sd=0.8 n=2.5", ["n=2.5", "whole"]),
    "centimetres without a unit": (f"new w {GRAIN} {CYLINDER} cylinder=6",
                                   ["cylinder=6", "no unit", "6 mm"]),
    "a narrow cylinder": (f"new w {GRAIN} {CYLINDER} cylinder=6mm", ["6 mm", "20 mm"]),
    "a misspelt option": (f"new w {GRAIN} --lifted-cilinder 26.1 27",
                          ["--lifted-cilinder", "--lifted-cylinder"]),
    "a misspelt key": (f"new w {GRAIN} {CYLINDER} cylider=60mm", ["cylider=60mm", "cylinder"]),
    "a key without its mark": (f"new w {GRAIN} {CYLINDER} cylinder 60mm",
                               ["cylinder=VALUE", "one word"]),
    "spaces about the mark": (f"new w {GRAIN} {CYLINDER} cylinder = 60mm", ["cylinder=VALUE"]),
    "a rig without readings": (f"new w {GRAIN} --lifted-cylinder cylinder=60mm",
                               ["angle", "26.1"]),
    "a mass for a depth": (f"new w {GRAIN} {CYLINDER} depth=80kg", ["depth=80kg", "mm"]),
    "a cylinder as wide as space": (f"new w {GRAIN} {CYLINDER} cylinder=1e99mm",
                                    ["cylinder=1e99mm", "20,000 mm"]),
    "a plate under the cylinder": (f"new w {GRAIN} {CYLINDER} cylinder=60mm plate=50mm",
                                   ["plate=50mm", "60 mm", "mm or more"]),
    "a wall of rubber": (f"new w {GRAIN} {CYLINDER} wall=rubber", ["wall=rubber", "steel"]),
    "two cylinders": (f"new w {GRAIN} {ANGLE} --lifted-cylinder 30 31 cylinder=80mm",
                      ["30", "one test"]),
    "a rebound above its drop": (f"new w {GRAIN} {ANGLE} --drop 310mm 300mm height=300mm",
                                 ["310mm", "300 mm", "less"]),
    "a restitution for a rebound": (f"new w {GRAIN} {ANGLE} --drop 0.51 0.52 height=300mm",
                                    ["--drop 0.51", "no unit", "mm"]),
    "a drop from nowhere": (f"new w {GRAIN} {ANGLE} --drop 78mm 80mm", ["height", "300 mm"]),
    "a friction for an angle": (f"new w {GRAIN} {ANGLE} --tilted-plane 0.38 0.39",
                                ["--tilted-plane 0.38", "rad"]),
    "two walls": (f"new w {GRAIN} {ANGLE} --drop 78mm 80mm height=300mm wall=steel "
                  "--tilted-plane 21 22 wall=glass", ["steel", "glass", "study for each"]),
    "single grains alone": (f"new w {GRAIN} --drop 78mm 80mm height=300mm",
                            ["Drop test", "angle of repose", "bulk density"]),
    "a bed denser than its grains": (f"new w {GRAIN} {ANGLE} --bulk-density 1400kg/m3 1410kg/m3",
                                     ["1400kg/m3", "1320 kg/m3"]),
    "a shear test without a load": (f"new w {GRAIN} {ANGLE} --shear-cell 1.9kPa 2.0kPa",
                                    ["--shear-cell", "load", "2 kPa"]),
    "a load within the reading": (f"new w {GRAIN} {ANGLE} --shear-cell 1.9kPa=2kPa",
                                  ["1.9kPa=2kPa", "kPa"]),
    "a narrow funnel": (f"new w {GRAIN} --funnel 26 27 orifice=12mm plate=100mm height=75mm",
                        ["orifice=12mm", "20 mm", "lifted cylinder"]),
    "a low funnel": (f"new w {GRAIN} --funnel 26 27 orifice=25mm plate=100mm height=20mm",
                     ["height=20mm", "24.9 mm"]),
    "a funnel without an orifice": (f"new w {GRAIN} --funnel 26 27 plate=100mm height=75mm",
                                    ["orifice", "25 mm"]),
    "one heap": (f"new w {GRAIN} --measured 26 {RIG}", ["--measured", "second reading", "sd"]),
    "a table that is not there": (f"new w {GRAIN} --measured angles.csv {RIG}", ["angles.csv"]),
    "angles twice": (f"new w {GRAIN} {FUNNEL} --measured 26 28", ["--measured", "--funnel"]),
    "a flood": (f"new w {GRAIN} --measured 26 27 {RIG} --rate 5000g/s", ["--rate", "75.4 g/s"]),
    "axes apart": (f"new w --density 1.32g/cm3 --axes 6.2 3.3 2.9 {ANGLE}",
                   ["--axes 6.2", "6.2x3.3x2.9mm"]),
    "one axis": (f"new w --density 1.32g/cm3 --axes 6.2mm {ANGLE}", ["6.2mm", "1 of 3"]),
    "four axes": (f"new w --density 1.32g/cm3 --axes 6.2x3.3x2.9x1mm {ANGLE}", ["4 of 3"]),
    "a needle": (f"new w --density 1.32g/cm3 --axes 30x3x3mm {ANGLE}",
                 ["30x3x3mm", "10.0 times", "dem clump"]),
    "a flake": (f"new w --density 1.32g/cm3 --axes 10x8x1mm {ANGLE}", ["10x8x1mm", "dem clump"]),
    "a misspelt material": (f"new w {GRAIN} {ANGLE} --material wheet", ["wheet", "wheat"]),
    "a water content": (f"new w {GRAIN} {ANGLE} --moisture 12%", ["--moisture", "dry", "moist"]),
    "too few grains": (f"new w {GRAIN} {ANGLE} --grains 10", ["--grains 10", "300"]),
    "many grains": (f"new w {GRAIN} {ANGLE} --grains many", ["--grains", "many", "--help"]),
    "an option that is not there": (f"new w {GRAIN} {ANGLE} --angle 27", ["--angle", "--help"]),
    "an arch": (f"new w {GRAIN} {ANGLE} --discharge 45g/s 46g/s orifice=9mm",
                ["orifice=9mm", "20 mm"]),
    "taps that nobody counted": (f"new w {GRAIN} {ANGLE} --tapped-density 800kg/m3 810kg/m3",
                                 ["taps", "100"]),
    "a powder that bounces": (f"new w {POWDER} {ANGLE} --drop 78mm 80mm height=300mm",
                              ["--drop 78mm", "0.3 mm"]),
    "sizes for a table": (f"new w --density 2.6g/cm3 --sieve 8-16mm {ANGLE}",
                          ["--sieve", "8-16mm", "table of sieves"]),
    "a workbook that is not there": ("new w --from nothere.xlsx", ["nothere.xlsx"]),
    "a table of one test": ("new w --from angles.txt", ["angles.txt", "test", "angle"]),
    "a table of another kind": ("new --table tests.txt", ["tests.txt", ".xlsx", ".csv"]),
    "readings that are all the same": (f"new w {GRAIN} --measured 27 27 27 {RIG}",
                                       ["27", "sd", "n=3"]),
    "the same in a cylinder": (f"new w {GRAIN} --lifted-cylinder 27 27 27", ["27", "sd", "n=3"]),
    "a slope in percent": (f"new w {GRAIN} --measured 26.1% 27% {RIG}", ["26.1%", "14.63"]),
    "a slope in a cylinder": (f"new w {GRAIN} --lifted-cylinder 50% 52%", ["50%", "26.57"]),
    "decimal commas between commas": (f"new w {GRAIN} --measured 26,1,27,4 {RIG}",
                                      ["26,1,27,4", "26.1, 27.4", "spaces"]),
    "the same of a cylinder": (f"new w {GRAIN} --lifted-cylinder 26,1,27,4", ["26.1, 27.4"]),
    "an angle below the horizon": (f"new w {GRAIN} --measured -26 27 {RIG}", ["-26", "89°"]),
    "a table beside a reading": (f"new w {GRAIN} --measured angles.txt 27 {RIG}",
                                 ["angles.txt", "all readings"]),
    "a picture of nothing": (f"new w {GRAIN} --measured same.png other.png {RIG}",
                             ["other.png", "same.png", "once"]),
    "a rate of nothing": (f"new w {GRAIN} --measured 26 27 {RIG} --rate 0g/s",
                          ["--rate 0g/s", "more than 0"]),
    "a material of lead and gold": (f"new w --density 50g/cm3 --grain 4mm {ANGLE}",
                                    ["--density", "50g/cm3", "25,000 kg/m³"]),
    "a drop from the clouds": (f"new w {GRAIN} {ANGLE} --drop 78mm 80mm height=300m",
                               ["--drop", "height=300m", "20,000 mm"]),
    "a lift like a shot": (f"new w {GRAIN} {CYLINDER} speed=20m/s", ["speed=20m/s", "2,000 mm/s"]),
    "a spread above its mean": (f"new w {GRAIN} --lifted-cylinder 26 sd=40 n=5",
                                ["sd=40", "26", "less than the reading"]),
    "a bed that taps loosen": (f"new w {GRAIN} {ANGLE} --tapped-density 700kg/m3 705kg/m3 taps=100 "
                               "--bulk-density 765kg/m3 770kg/m3", ["700kg/m3", "765kg/m3"]),
    "a stress that falls with its load": (
        f"new w {GRAIN} {ANGLE} --shear-cell 1.9kPa load=2kPa --shear-cell 1.5kPa load=4kPa "
        "--shear-cell 1kPa load=6kPa", ["1 kPa under 6 kPa", "1.9 kPa under 2 kPa", "rises"]),
    "grains in powers of ten": (f"new w {GRAIN} {ANGLE} --grains 1e4", ["1e4", "10000"]),
    "grains by the thousand": (f"new w {GRAIN} {ANGLE} --grains 10.000", ["10.000", "10000"]),
    "a sieve that stands twice": (f"new w --density 2.65g/cm3 --sieve twice.csv {ANGLE}",
                                  ["twice.csv", "4 mm", "twice"]),
    "less than nothing on a sieve": (f"new w --density 2.65g/cm3 --sieve less.csv {ANGLE}",
                                     ["less.csv, line 3", "-5", "0 or more"]),
    "a sheet of nothing": (f"new w {GRAIN} {ANGLE} --sheet Mai", ["--sheet Mai", "workbook"]),
    "a workbook that loses what was told": (f"new --table x.xlsx {GRAIN} {ANGLE}",
                                            ["--table x.xlsx", "--from x.xlsx"]),
    "a workbook and a folder": ("new w --table x.xlsx", ["--table x.xlsx", "--from x.xlsx"]),
    "a drop whose rebound is missing": (f"new w {GRAIN} {ANGLE} --drop drops.csv",
                                        ["drops.csv, line 3", "rebound"]),
    "a table of masses": (f"new w {GRAIN} --measured masses.csv {RIG}",
                          ["masses.csv, line 2", "kg", "°"]),
}  # fmt: skip


OPTIONS |= {
    "a mass that would be tons": (
        f"new w {GRAIN} {ANGLE} --discharge time=6.3 sd=0.2 n=5 mass=500 orifice=25",
        ["mass=500", "no unit", "500 kg", "orifice=25", "time=6.3", "sd=0.2"]),
    # rho 0.55 * 1320 kg/m3, clear opening 25 - 1.4 * 4 mm: 0.58 * 726 * 3.132 * 0.0194**2.5
    "a flow that no orifice passes": (
        f"new w {GRAIN} {ANGLE} --discharge time=6.3s sd=0.2s n=5 mass=500kg orifice=25mm",
        ["time=6.3s", "7.937e+04 g/s", "25 mm", "69.1 g/s", "138 g/s"]),
    "a trickle": (f"new w {GRAIN} {ANGLE} --discharge 5g/s 5.1g/s orifice=25mm",
                  ["5.05 g/s", "69.1 g/s", "6.91"]),
    "a bed without pores": (f"new w {GRAIN} {ANGLE} --bulk-density 1.25g/cm3 1.26g/cm3",
                            ["1250 kg/m3", "0.95", "1188"]),
    "a bed of air": (f"new w {GRAIN} {ANGLE} --tapped-density 0.3g/cm3 0.31g/cm3 taps=50",
                     ["300 kg/m3", "0.23", "396"]),
    "a wall of dry grains": (f"new w {GRAIN} --lifted-cylinder 70 71 cylinder=60mm",
                             ["70°", "2.75", "60°", "moist"]),
    "a heap flatter than without friction": (f"new w {GRAIN} --measured 4 5 {RIG}",
                                             ["4°", "5.8°"]),
}  # fmt: skip


FILES = {
    "angles.txt": "angle [°]\n26\n27\n",
    "twice.csv": "diameter_mm,passing_percent\n8,100\n4,50\n4,40\n2,0\n",
    "less.csv": "Siebweite [mm];Rückstand [g]\n16;0\n8;-5\n4;20\n2;2\n",
    "drops.csv": "Fallhöhe [mm];Rücksprung [mm]\n300;78\n300;\n",
    "masses.csv": "angle [kg]\n26\n27\n",
    "same.png": "a picture",
    "other.png": "a picture",
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").mkdir()
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def refused_words(words, capsys):
    """What the command says to refuse these words; nothing is left of the study."""
    try:
        status = main(words)
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert not Path("w").exists()
    return capsys.readouterr().err


@pytest.mark.parametrize("name", OPTIONS)
def test_an_option_is_refused_with_its_place_and_what_is_right(here, name, capsys):
    line, facts = OPTIONS[name]
    pilot = [] if "--table" in line else ["--no-pilot"]
    said = refused_words([*shlex.split(line), *pilot], capsys)
    missing = [fact for fact in facts if not holds(said, fact)]
    assert not missing, said
    assert "Traceback" not in said
    assert "w/" not in said  # no file that is gone
