"""What people hand in that is refused: the kind of file or option, what is wrong with it, and what
the refusal must name.

A case of a text is a sound file with one thing changed: `(fault, old, new, *named)`; where `old` is
empty, `new` stands at the end. A case of `WRITTEN` has a function that writes the file, a case of
`OPTIONS` the words behind `dem new`.
"""

import io
import zipfile

import numpy as np
import openpyxl
from PIL import Image
from scipy.io import wavfile

CONFIGURATION = """name: wheat
factors: factors.tsv
measurements: measured.csv
tests: { heap: { experiment: heap } }
fixed: { friction: 0.5 }
run:
  materials:
    particle: { density_kg_m3: 1350 }
  particles:
    diameter_mm: 4
screening: { kind: plackett_burman, runs: 12 }
"""
FACTORS = (
    "code\tname\tkey\tlow\thigh\n"
    "A\tfriction\tcontacts.particle_particle.static_friction\t0.2\t0.8\n"
    "B\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\n"
    "C\tbounce\tcontacts.particle_particle.restitution\t0.2\t0.8\n"
)
MEASURED = (
    "experiment,quantity,value,unit\n"
    "heap,angle_of_repose,26.1,deg\n"
    "heap,angle_of_repose,28.4,deg\n"
    "heap,angle_of_repose,27.0,deg\n"
)
RUN = "heap-0123456789abcdef"
TEXTS = {
    "configuration": CONFIGURATION,
    "factors": FACTORS,
    "measured table": MEASURED,
    "run spec": "experiment: heap\n",
    "shear tester": "normal_stress [kPa],shear_stress [kPa]\n1,0.8\n2,1.5\n4,2.9\n",
    "design": "run,A,B,C\n1,1,-1,-1\n2,-1,1,-1\n3,-1,-1,1\n4,1,1,1\n",
    "sieve table": "diameter_mm,mass_percent\n1.0,20\n2.0,50\n3.0,30\n",
    "sizes": "diameter_mm,passing_percent\n1.0,0\n2.0,40\n3.0,100\n",
    "clump": "x_mm,y_mm,z_mm,radius_mm\n0,0,0,1\n1.0,0.2,0,0.8\n-3e-1,0.9,0.5,0.6\n",
    "STL": "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid s\n",
    "numerics": "seeds: 5\npoints:\n  low: { salt_salt_rolling_friction: 0.11 }\nvariants:\n"
    "  full scale: { run: { particles: { count: 10000 } } }\n"
    "  coarse: { against: full scale, run: { particles: { count: 2500 } } }\n",
    "responses": f"run_id,angle_of_repose_deg\n{RUN},31.5\n",
    "metrics": '{"angle_of_repose_deg": 31.5, "height_mm": 12}',
}
"""Kind: a sound file; a configuration stands beside the two tables below it."""

LINEAR = """laws: {normal: linear, damping: linear, tangential: linear}
law_parameters: {normal_stiffness_N_m: 1000000}"""
SIZES = "particles: {{sizes: {{by: number, diameters_mm: {}, fractions: {}}}}}"


CASES = {
    "configuration": [
        ("a key twice", "name: wheat", "name: wheat\nname: oats", "line 2", "oats"),
        ("a name that leaves the folder", "wheat", "../wheat", "line 1", "../wheat"),
        ("a name with a space", "wheat", "my wheat", "line 1", "my wheat", "letters"),
        ("no test", "tests: { heap: { experiment: heap } }\n", "", "tests", "must be given"),
        ("no experiment", "{ experiment: heap }", "{}", "line 4", "tests.heap.experiment"),
        ("an experiment of nothing", "{ experiment: heap }", "{ experiment: pile }", "line 4",
         "pile", "heap"),
        ("the name of a test that is none", "heap: {", "2nd: {", "line 4", "tests.2nd", "letter"),
        ("a sweep of a heap", "experiment: heap }", "experiment: heap, sweep: { levels: "
         "[0.1, 0.2, 0.3, 0.4] } }", "line 4", "tests.heap.sweep", "tilt, drop, shear"),
        *(
            (f"the old key {old}", "", f"{old}: {{}}", "line 12", old, "no more", new)
            for old, new in (
                ("target", "calibrate"), ("further_targets", "joint"), ("bench", "sweep"),
                ("rigs", "tests"), ("targets", "table of measurements"), ("experiment", "tests"),
                ("push_through", "predict"),
            )
        ),
        ("no measurements", "measurements: measured.csv\n", "", "measurements"),
        ("a list for a mapping", "{ experiment: heap }", "[angle]", "line 4", "tests.heap"),
        ("a word for a number", "1350", "heavy", "line 8", "heavy"),
        ("infinity", "1350", ".inf", "line 8", "inf"),
        ("kg per litre", "1350", "1.35", "line 8", "1.35 g/cm³ (1350 kg/m³)"),
        ("a unit of another kind", "1350", "1350 mm", "line 8", "1350 mm"),
        ("a modulus of ten pascals", "density_kg_m3: 1350",
         "density_kg_m3: 1350, shear_modulus_Pa: 10", "line 8", "shear_modulus_Pa", "10 MPa"),
        ("a decimal comma", "diameter_mm: 4", "diameter_mm: 4,2", "line 10", "4,2", "number"),
        ("metres", "diameter_mm: 4", "diameter_mm: 0.0038", "line 10", "0.0038 m (3.8 mm)"),
        ("a mass for a length", "diameter_mm: 4", "diameter_mm: 4 kg", "line 10", "4 kg", "mm"),
        ("minus a length", "diameter_mm: 4", "diameter_mm: -4", "line 10", "-4"),
        ("a misspelt key of the run", "diameter_mm", "diametre_mm", "line 10", "diametre_mm",
         "diameter_mm"),
        ("grains that stop the funnel", "diameter_mm: 4", "diameter_mm: 9", "orifice_diameter_mm"),
        ("a tab", "  particles:", "\tparticles:", "line 9"),
        ("an alias of nothing", "name: wheat", "name: *wheat", "line 1"),
        ("no end of a bracket", "runs: 12 }", "runs: 12", "line 12"),
        ("an unknown section", "screening:", "sreening:", "line 11", "sreening", "screening"),
        ("half a run", "runs: 12", "runs: 12.5", "line 11", "12.5"),
        ("a level of significance above 1", "runs: 12", "alpha: 2", "line 11", "screening.alpha",
         "2", "less than 1"),
        *(
            (f"a wrong engine, {engine}", "", f"engine: {engine}", "engine", *named)
            for engine, *named in (
                ("edem", "engine.name", "edem", "dem, command"),
                ("{ name: command, version: '1' }", "engine.command"),
                ("{ name: command, command: 'x {here}', version: '1' }", "engine.command",
                 "x {here}", "{spec}", "{seed}"),
                ("{ name: command, command: 'x {', version: '1' }", "engine.command", "x {",
                 "{spec}"),
                ("""{ name: command, command: "x 'y", version: '1' }""", "engine.command", "x 'y",
                 "quotation"),
                ("{ name: command, command: x, version: '1', files: [none.py] }", "engine.files",
                 "none.py"),
                ("{ name: dem, timeout_s: 3 }", "engine.name", "dem"),
                ("{ name: table, responses: r.csv, code: EDEM, sep: ; }", "engine.sep", ";"),
            )
        ),
        ("a plane that tilts back", "experiment: heap }", "experiment: heap }, chute: "
         "{ experiment: tilt, run: { geometry: { tilt_rate_deg_s: -5 } } }", "line 4",
         "tests.chute.run.geometry.tilt_rate_deg_s", "-5"),
        ("a metric of nothing", "", "calibrate: { to: colour }", "line 12", "colour",
         "angle_of_repose_deg"),
        ("a table that is not there", "measured.csv", "none.csv", "none.csv"),
        ("factors that are not there", "factors.tsv", "none.tsv", "none.tsv"),
        ("a factor of nothing", "fixed: { friction", "fixed: { fricton", "line 5", "fricton",
         "friction"),
        ("a step of nobody", "", "ascent: { step: { x: 1 } }", "line 12", "ascent.step.x"),
        ("no width", "", "response_surface: { half_width: { bounce: 0 } }", "half_width",
         "greater than 0"),
        ("a rule of nothing", "", "ascent: { rule: best }", "ascent.rule", "configured"),
        ("fewer runs than the first ones", "",
         "optimise: { candidate_half_width: 0.5, candidate_at_most: 5 }",
         "optimise.candidate_runs", "10", "2 to 5"),
        ("no run to tell the scatter", "",
         "optimise: { candidate_half_width: 0.5, candidate_runs: 0 }", "optimise.candidate_runs",
         "0", "2 to 100"),
        ("a rule that is no more", "", "optimise: { rule: closest_to_centre }", "optimise.rule",
         "centre"),
        ("a law without its number", "  particles:", "  laws: { cohesion: sjkr }\n  particles:",
         "cohesion_energy_density_J_m3"),
        ("a metric in a mapping", "", "calibrate: { to: { height_mm: {} } }", "line 12",
         "calibrate.to"),
    ],
    "factors": [
        ("a level of words", "0.2\t0.8\nB", "low\t0.8\nB", "line 2", "low"),
        ("low and high swapped", "0.2\t0.8\nB", "0.8\t0.2\nB", "line 2", "high", "0.2", "0.8"),
        ("commas beside points", "0.2\t0.8\nB", "0,2\t0.8\nB", "line 2", "0,2"),
        ("infinity", "0.02\t0.4", "0.02\tinf", "line 3", "inf"),
        ("a code twice", "B\trolling", "A\trolling", "line 3", "A"),
        ("a name twice", "rolling\t", "friction\t", "line 3", "friction"),
        ("a name that a spreadsheet computes", "rolling\t", "=rolling\t", "line 3", "=rolling"),
        ("a key twice", "rolling_friction", "static_friction", "line 3", "static_friction"),
        ("a misspelt key", "static_friction", "static_fricton", "static_fricton",
         "static_friction"),
        ("words for a law", "contacts.particle_particle.restitution\t0.2\t0.8",
         "laws.damping\ttsuji\tthornton", "line 4", "column low", "tsuji"),
        ("a level that no run has", "restitution\t0.2", "restitution\t0", "low", "0.03"),
        ("a row too short", "\t0.02\t0.4", "\t0.02", "line 3"),
        ("a column that is missing", "high", "upper", "line 1", "high", "code"),
        ("no rows", FACTORS[FACTORS.index("A\t") :], "", "factors.tsv"),
        ("a picture", FACTORS, "\x89PNG\r\n\x1a\n" + "\0" * 60, "factors.tsv"),
    ],
    "measured table": [
        ("a negative angle", "28.4", "-28.4", "line 3", "-28.4"),
        ("a lost decimal point", "28.4", "284", "line 3", "value", "284.0", "0.1 to 89"),
        ("radians", "28.4,deg", "0.46,", "line 3", "0.46", "0.46 rad (26.36 °)"),
        ("a word", "28.4", "steep", "line 3", "steep"),
        ("an error of a spreadsheet", "28.4", "#DIV/0!", "line 3", "#DIV/0!"),
        ("a range", "28.4", "27-29", "line 3", "27-29"),
        ("a unit of nothing", "28.4,deg", "28.4,furlong", "line 3", "furlong"),
        ("a misspelt quantity", "repose,28.4", "reposse,28.4", "line 3", "angle_of_reposse",
         "angle_of_repose"),
        ("an experiment of nothing", "heap,angle_of_repose,28.4", "pile,angle_of_repose,28.4",
         "line 3", "pile"),
        ("a row too long", "28.4,deg", "28.4,deg,a,b", "line 3"),
        ("a missing column", "value", "valeu", "line 1", "value", "valeu"),
        ("a quotation mark left open", "heap,angle_of_repose,28.4", '"heap,angle_of_repose,28.4',
         "line 3"),
        ("one reading", MEASURED[MEASURED.index("heap,angle_of_repose,28.4") :], "", "measured.csv",
         "two"),
        ("a mean and its readings", MEASURED, "experiment,quantity,value,unit,sd,n\n"
         "heap,angle_of_repose,26,deg,1,5\nheap,angle_of_repose,27,deg,,\n", "line 3", "line 2"),
        ("a spread below zero", "unit\nheap,angle_of_repose,26.1,deg",
         "unit,sd,n\nheap,angle_of_repose,26.1,deg,-1,3", "line 2", "-1.0"),
        ("half a replicate", "unit\nheap,angle_of_repose,26.1,deg",
         "unit,sd,n\nheap,angle_of_repose,26.1,deg,1,2.5", "line 2", "2.5"),
        ("an empty file", MEASURED, "", "measured.csv"),
        ("zeros of a power cut", MEASURED, "\0" * 300, "measured.csv"),
    ],
    "run spec": [
        ("an experiment of nothing", "heap", "pile", "experiment", "pile", "heap"),
        ("a misspelt key", "", "sed: 1", "sed", "seed"),
        ("a word for a number", "", "seed: one", "seed", "integer"),
        ("half a grain", "", "particles: {count: 300.5}", "particles.count", "300.5"),
        ("no grains", "", "particles: {count: 0}", "particles.count",
         "greater than or equal to 1"),
        ("a material that does not shrink", "", "materials: {particle: {poisson_ratio: 0.5}}",
         "poisson_ratio", "less than 0.5"),
        ("a material of nothing", "", "materials: {steel: {}}", "materials.steel", "particle"),
        ("no restitution", "", "contacts: {particle_particle: {restitution: 0}}", "restitution",
         "0.03"),
        ("a law without its number", "", "laws: {cohesion: sjkr}", "laws.cohesion",
         "cohesion_energy_density_J_m3"),
        ("a number without its law", "", "law_parameters: {surface_energy_J_m2: 0.1}",
         "surface_energy_J_m2", "jkr"),
        *(
            (f"laws that do not go together: {laws}", "", f"laws: {{{laws}}}\n"
             f"law_parameters: {{{parameters}}}", *named)
            for laws, parameters, *named in (
                ("normal: linear, damping: linear", "normal_stiffness_N_m: 500", "laws.tangential",
                 "mindlin", "linear"),
                ("normal: walton_braun", "normal_stiffness_N_m: 500", "laws.damping", "tsuji",
                 "walton_braun"),
                ("damping: none", "", "laws.damping", "none"),
                ("tangential: linear", "", "laws.tangential", "linear", "hertz"),
                ("normal: eepa, damping: none", "", "laws.normal", "eepa", "adhesion_energy_J_m2"),
            )
        ),
        ("laws that do not go together", "", "laws: {cohesion: jkr, damping: thornton}\n"
         "law_parameters: {surface_energy_J_m2: 0.1}", "laws.damping", "tsuji"),
        ("a share of the Rayleigh time that a law does not bear", "", LINEAR, "laws.normal",
         "numerics.rayleigh_fraction", "0.4"),
        ("a step that a law does not bear", "", LINEAR + "\nnumerics: {time_step_s: 1.0e-5}",
         "laws.normal", "numerics.time_step_s", "1e-05"),
        ("dust in single precision", "", "particles: {diameter_mm: 5.0e-5}\n"
         "geometry: {injection_speed_m_s: 1.0e-4}", "numerics.precision", "double"),
        ("grains that stop the funnel", "", "particles: {diameter_mm: 8}",
         "geometry.orifice_diameter_mm", "3 of the largest grain"),
        # two spheres of 4.4 mm / 2^(1/3) in a row
        ("long grains that stop the funnel", "", "particles: {diameter_mm: 4.4, elongation: 2}",
         "geometry.orifice_diameter_mm", "6.98456 mm"),
        ("grains too long", "", "particles: {elongation: 2.1}", "particles.elongation", "2"),
        *(
            (f"a {experiment} that cannot work: {parts}", "heap", f"{experiment}\n{parts}", *named)
            for experiment, parts, *named in (
                ("drum", "particles: {count: 90}", "particles.count", "one layer"),
                ("drum", "particles: {count: 5000}", "particles.count", "70 % full"),
                ("drum", "geometry: {drum_width_mm: 5}", "drum_width_mm", "3 of the largest"),
                ("compression", "geometry: {lid_travel_mm: 10}", "lid_travel_mm", "cannot reach"),
                ("compression", "geometry: {box_height_mm: 20}", "box_height_mm", "grains need"),
                ("compression", "geometry: {packing: cubic}", "packing", "whole layers"),
                ("compression", "geometry: {seating_stress_kPa: 30}", "seating_stress_kPa", "load"),
                ("wall_friction", "geometry: {ring_diameter_mm: 60}", "ring_diameter_mm",
                 "two layers"),
                ("bulk_density", "geometry: {vessel_diameter_mm: 9}", "vessel_diameter_mm",
                 "5 of the largest"),
                ("bulk_density", "particles: {count: 300}", "vessel_diameter_mm", "mm deep"),
                ("bulk_density", "geometry: {vessel_diameter_mm: 20, simulated_diameter_mm: 24}",
                 "simulated_diameter_mm", "at most 20"),
                ("lifted_cylinder", "geometry: {plate_diameter_mm: 30}", "plate_diameter_mm", "32"),
                ("discharge", "geometry: {orifice_diameter_mm: 9}", "orifice_diameter_mm",
                 "arches"),
                ("discharge", "geometry: {silo_diameter_mm: 35}", "silo_diameter_mm",
                 "at least 2.5"),
                ("discharge", "particles: {count: 500}", "silo_diameter_mm", "mm deep"),
                ("draw_down", "geometry: {slot_width_mm: 9}", "slot_width_mm", "arches"),
                ("draw_down", "geometry: {depth_mm: 5}", "depth_mm", "3 of the largest"),
                ("draw_down", "geometry: {upper_width_mm: 30}", "upper_width_mm", "at least 36"),
                ("draw_down", "geometry: {lower_width_mm: 30}", "lower_width_mm", "at least 36"),
                ("draw_down", "geometry: {fall_height_mm: 20}", "fall_height_mm", "lower box"),
                ("draw_down", "particles: {count: 500}", "upper_width_mm", "mm deep"),
            )
        ),
        ("long grains on a plane", "heap", "tilt\nparticles: {elongation: 1.5}",
         "particles.elongation", "bulk_density"),
        ("shares that make too little", "", SIZES.format([1.0, 2.0], [0.5, 0.4]),
         "particles.sizes.fractions", "sum to 1"),
        ("a table of sizes that is not there", "", "particles: {sizes: {file: none.csv}}",
         "none.csv", "particles.sizes.file"),
        ("sizes beside their table", "", "particles: {sizes: {file: x.csv, fractions: [1.0]}}",
         "particles.sizes.fractions", "particles.sizes.file"),
        ("sizes far apart", "", SIZES.format([0.1, 2.0], [0.5, 0.5]),
         "particles.sizes.diameters_mm", "ratio"),
        ("a funnel that opens downwards", "", "geometry: {funnel_top_diameter_mm: 15}",
         "funnel_top_diameter_mm", "more than the orifice"),
        ("a plate of few grains", "", "geometry: {plate_diameter_mm: 5}", "plate_diameter_mm",
         "4 of the largest"),
        ("a step too long", "", "numerics: {time_step_s: 1.0e-3}", "numerics.time_step_s",
         "Rayleigh"),
        ("no end of time", "", "numerics: {max_time_s: .nan}", "numerics.max_time_s", "finite"),
        ("pictures at no times", "", "output: {frames: 5}", "output.frames", "frame_interval_s"),
        ("a list", "experiment: heap", "- 1", "nonsense.yaml", "mapping"),
    ],
    "shear tester": [
        ("a minus load", "2,1.5", "-2,1.5", "line 3", "-2"),
        ("a unit of another kind", "shear_stress [kPa]", "shear_stress [mm]", "line 2", "mm"),
        ("no stress", "shear_stress", "temperature", "line 1"),
    ],
    "design": [
        ("a level of words", "2,-1,1", "2,high,1", "line 3", "high"),
        ("a level beyond", "2,-1,1", "2,7,1", "line 3", "7"),
        ("a factor of nothing", "run,A,", "run,Z,", "nonsense.csv", "A"),
        ("a factor twice", "run,A,B", "run,A,A", "line 1", "A"),
        ("a gap", "2,-1,1", "2,,1", "line 3"),
    ],
    "sieve table": [
        ("too little in all", "2.0,50", "2.0,5", "55"),
        ("shares of one", "1.0,20\n2.0,50\n3.0,30", "1.0,0.2\n2.0,0.5\n3.0,0.3", "100"),
        ("a minus sieve", "2.0,50", "-2.0,50", "line 3", "-2.0"),
        ("no shares", "mass_percent", "colour", "line 1", "colour"),
    ],
    "sizes": [
        ("sieves that descend", "2.0,40", "0.5,40", "line 3", "0.5"),
        ("a passing that falls", "2.0,40", "2.0,-4", "line 3", "-4.0"),
        ("no end", "3.0,100", "3.0,90", "line 4", "90.0"),
        ("no begin", "1.0,0", "1.0,5", "line 2", "5.0"),
    ],
    "clump": [
        ("a minus radius", "1.0,0.2,0,0.8", "1.0,0.2,0,-0.8", "line 3", "-0.8"),
        ("a sphere inside another", "1.0,0.2,0,0.8", "0.1,0,0,0.2", "line 3"),
        ("a sphere far away", "1.0,0.2,0,0.8", "90,0.2,0,0.8", "line 3"),
        ("a column more", "radius_mm\n", "radius_mm,colour\n", "line 2", "colour"),
    ],
    "STL": [
        ("a corner of words", "vertex 1 0 0", "vertex one 0 0", "line 5"),
        ("four corners", "endloop", "vertex 1 1 0\nendloop", "line 7"),
        ("cut off", "endfacet\nendsolid s\n", "", "line 7"),
        ("metres of kilometres", "vertex 1 0 0", "vertex 2e6 0 0", "line 2"),
        ("a line for a triangle", "vertex 0 1 0", "vertex 2 0 0", "triangle"),
        ("open", "solid s\nfacet", "solid s\nfacet", "nonsense.stl", "3"),
        ("a web page", "solid s\n", "<!doctype html><title>404</title>", "nonsense.stl"),
    ],
    "numerics": [
        ("no seeds", "seeds: 5", "seeds: 0", "line 1", "seeds"),
        ("a factor of nothing", "salt_salt_rolling", "salt_pepper_rolling", "line 3",
         "salt_pepper_rolling_friction"),
        ("a variant of nothing", "against: full scale", "against: fine", "line 6", "fine"),
        ("no keys to lay over", "run: { particles: { count: 10000 } }", "", "line 5", "run"),
        ("no variants", "variants:\n", "variant:\n", "nonsense.yaml", "variant"),
    ],
    "responses": [
        ("a run twice", "31.5\n", f"31.5\n{RUN},30\n", "2, 3"),
        ("another run", RUN, "heap-1", RUN),
        ("no name of a run", "run_id", "run", "run_id"),
    ],
    "metrics": [
        ("a word", "31.5", '"steep"', "angle_of_repose_deg", "steep"),
        ("infinity", "31.5", "1e999", "angle_of_repose_deg", "inf"),
        ("a list", '{"angle_of_repose_deg": 31.5, "height_mm": 12}', "[31.5]", "nonsense.json"),
        ("cut off", '12}', "", "nonsense.json"),
    ],
}  # fmt: skip


def book(*sheets, merge=()):
    """Return what writes a workbook; each sheet is a list of rows, with areas of merged cells."""

    def write(path):
        made = openpyxl.Workbook()
        made.remove(made.active)
        for n, rows in enumerate(sheets):
            made.create_sheet(f"sheet {n}")
            for row in rows:
                made.worksheets[n].append(row)
            for area in merge:
                made.worksheets[n].merge_cells(area)
        made.save(path)

    return write


def content(data):
    """Return what writes these bytes."""
    return lambda path: path.write_bytes(data)


def image(array):
    """Return what writes a picture of an array."""
    return lambda path: Image.fromarray(array).save(path, "PNG")


def wave(samples):
    """Return what writes a recording of 8 kHz."""
    return lambda path: wavfile.write(path, 8000, samples)


def cut(write, count):
    """Return what writes the first `count` bytes of a file alone."""

    def short(path):
        write(path)
        path.write_bytes(path.read_bytes()[:count])

    return short


def packed(name):
    """Bytes of a compressed file with one part."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as target:
        target.writestr(name, "<a/>")
    return out.getvalue()


ROWS = [["experiment", "value"], ["heap", 26.1], ["heap", 27.4]]
GREY = np.full((120, 160, 3), 128, np.uint8)
BOX = np.pad(np.full((60, 80, 3), 20, np.uint8), ((40, 20), (40, 40), (0, 0)), constant_values=230)
NOISE = np.random.default_rng(3)
WRITTEN = {
    "workbook": [
        ("no table", book([]), "nonsense.xlsx"),
        ("two sheets", book(ROWS, [["value", 1]]), "nonsense.xlsx", "sheet 1"),
        ("a formula that was never counted", book([ROWS[0], ["heap", "=B9+1"]]), "line 2", "=B9+1"),
        ("an error of a spreadsheet", book([ROWS[0], ["heap", "#REF!"]]), "line 2"),
        ("a heading twice", book([["value", "value"], [1, 2]]), "value"),
        ("a zip of something else", content(packed("a.txt")), "nonsense.xlsx"),
        ("cut off", cut(book(ROWS), 900), "nonsense.xlsx"),
        ("an old workbook", content(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 99),
         "nonsense.xlsx"),
    ],
    "photograph": [
        ("nothing on it", image(GREY), "nonsense.png"),
        ("noise", image(NOISE.integers(0, 255, GREY.shape, np.uint8)), "nonsense.png"),
        ("a box in place of a heap", image(BOX), "nonsense.png"),
        ("cut off", cut(image(BOX), 200), "nonsense.png"),
        ("text", content(b"a photograph of a heap"), "nonsense.png"),
    ],
    "sound": [
        ("silence", wave(np.zeros(8000, np.int16)), "nonsense.wav"),
        ("noise", wave(NOISE.normal(0, 3000, 16000).astype(np.int16)), "nonsense.wav"),
        ("no samples", wave(np.ones(0, np.int16)), "nonsense.wav"),
        ("cut off in its head", cut(wave(np.ones(9, np.int16)), 20), "nonsense.wav"),
        ("text", content(b"click click click"), "nonsense.wav"),
    ],
}  # fmt: skip

GRAIN = "--density 1.32g/cm3 --grain 4mm"
ANGLE = "--lifted-cylinder 26.1 27.4 28.0 cylinder=60mm depth=80mm"
NEW = f"w {GRAIN} {ANGLE}"
RIG = "--orifice 25mm --plate 100mm --height 75mm"
CYLINDER = f"w {GRAIN} --lifted-cylinder"
HANDED_IN = {
    "angles.txt": "angle [°]\n26\n27\n",
    "masses.csv": "angle [kg]\n26\n27\n",
    "drops.csv": "Fallhöhe [mm];Rücksprung [mm]\n300;78\n300;\n",
    "less.csv": "Siebweite [mm];Rückstand [g]\n16;0\n8;-5\n4;20\n2;2\n",
    "cumulative.csv": "Siebweite [mm];Rückstand [%]\n16;0\n8;40\n4;80\n2;100\n",
    "open.csv": "Siebweite [mm];Rückstand [%]\n8;50\n4;30\n2;20\n",
    "falls.csv": "Siebweite [mm];Durchgang [%]\n1;0\n2;60\n4;20\n",
    "begun.csv": "Siebweite [mm];Durchgang [%]\n1;10\n2;60\n4;100\n",
    "high.csv": "rebound [mm];height [mm]\n78;300\n0,3;300\n",
    "bare.csv": "rebound;height [mm]\n78;300\n79;\n",
    "twice.csv": "rebound [mm];Rückprallhöhe [mm]\n78;78\n",
    "walls.csv": "Rückprallhöhe [mm];wall\n78,5;steel\n81;steel\n",
    "same.png": "a picture",
    "other.png": "a picture",
}
"""Files beside the options."""
OPTIONS = [
    ("no folder", f"{GRAIN} {ANGLE}", "folder", "dem new FOLDER"),
    *(
        (f"a name that would be taken apart, {name}", f"{name} {GRAIN} {ANGLE}", "folder",
         "allowed")
        for name in ("a{b}", "a*b", "'it\"s'", "'a;b'", "'a  b'", "'$HOME'", "'a\\b'")
    ),
    ("a folder that is there", f"taken {GRAIN} {ANGLE}", "taken", "exists"),
    ("a misspelt option", f"w {GRAIN} --lifted-cilinder 26.1 27", "--lifted-cylinder"),
    ("an option that is not there", f"{NEW} --angle 27", "--angle", "--help"),
    # the grain
    ("no density", f"w --grain 4mm {ANGLE}", "--density", "1.32 g/cm3"),
    ("no size", f"w --density 1.32g/cm3 {ANGLE}", "size", "--grain", "--axes", "--sieve"),
    ("no test", f"w {GRAIN}", "--measured", "dem new --help"),
    ("a unit apart", f"w --density 1.32g/cm3 --grain 4 cm {ANGLE}", "one word", "4mm"),
    ("a bare density in g/cm3", f"w --density 1.32 --grain 4mm {ANGLE}", "--density", "1.32 g/cm³"),
    ("a mass for a density", f"w --density 1.32g --grain 4mm {ANGLE}", "1.32g", "kg/m³"),
    ("a negative density", f"w --density=-1320kg/m3 --grain 4mm {ANGLE}", "more than 0"),
    ("lead and gold", f"w --density 50g/cm3 --grain 4mm {ANGLE}", "50g/cm3", "25,000 kg/m³"),
    ("a range of sizes", f"w --density 1.32g/cm3 --grain 3-5mm {ANGLE}", "3-5mm", "sieve"),
    ("metres", f"w --density 1.32g/cm3 --grain 0.004 {ANGLE}", "--grain 0.004", "0.004 m (4 mm)"),
    ("two sizes", f"{NEW} --axes 6.2x3.3x2.9mm", "axes", "diameter"),
    ("axes apart", f"w --density 1.32g/cm3 --axes 6.2 3.3 2.9 {ANGLE}", "6.2x3.3x2.9mm"),
    ("one axis", f"w --density 1.32g/cm3 --axes 6.2mm {ANGLE}", "6.2mm", "1 of 3"),
    ("a needle", f"w --density 1.32g/cm3 --axes 30x3x3mm {ANGLE}", "10.0 times", "dem clump"),
    ("axes that are not all there", f"w --density 1.32g/cm3 --axes 6.2x3.3x2.9mm 6.2x3.3mm {ANGLE}",
     "2 of length", "1 of thickness"),
    ("axes without a unit", f"w --density 1.32g/cm3 --axes 6.2x3.3x2.9 {ANGLE}", "6.2x3.3x2.9",
     "no unit", "mm"),
    ("a flake", f"w --density 1.32g/cm3 --axes 12x11x2mm {ANGLE}", "6.0 times", "dem clump"),
    ("a misspelt material", f"{NEW} --material wheet", "wheet", "wheat"),
    ("a water content", f"{NEW} --moisture 12%", "--moisture", "dry", "moist"),
    ("too few grains", f"{NEW} --grains 10", "--grains 10", "300"),
    ("grains in powers of ten", f"{NEW} --grains 1e4", "1e4", "10000"),
    ("grains by the thousand", f"{NEW} --grains 10.000", "10.000", "10000"),
    ("sizes for a table", f"w --density 2.6g/cm3 --sieve 8-16mm {ANGLE}", "8-16mm",
     "table of sieves"),
    ("less than nothing on a sieve", f"w --density 2.65g/cm3 --sieve less.csv {ANGLE}",
     "less.csv, line 3", "-5", "0 or more"),
    ("a sieve curve for what stays on sieves",
     f"w --density 2.65g/cm3 --sieve cumulative.csv {ANGLE}", "220 %", "coarser sieves"),
    ("a passing that falls", f"w --density 2.65g/cm3 --sieve falls.csv {ANGLE}", "falls.csv"),
    ("no narrowest sieve", f"w --density 2.65g/cm3 --sieve begun.csv {ANGLE}", "10 %", "1 mm"),
    ("no widest sieve", f"w --density 2.65g/cm3 --sieve open.csv {ANGLE}", "50 %", "8 mm"),
    # readings
    ("a mean with its spread", f"{CYLINDER} '26.1±0.8'", "26.1±0.8", "sd=0.8", "n"),
    ("the same in words", f"{CYLINDER} 26.1 +/- 0.8", "+/-", "sd=0.8"),
    ("a lost point", f"{CYLINDER} 26.1 284", "284", "28.4 °"),
    ("radians", f"{CYLINDER} 0.46 0.48", "0.46", "0.46 rad"),
    ("a slope in percent", f"{CYLINDER} 50% 52%", "50%", "26.57"),
    ("not a number", f"{CYLINDER} NaN 27", "NaN", "number in deg"),
    ("decimal commas between commas", f"{CYLINDER} 26,1,27,4", "26.1, 27.4"),
    ("an angle below the horizon", f"w {GRAIN} --measured -26 27 {RIG}", "-26", "89°"),
    ("one reading", f"{CYLINDER} 26.1", "26.1", "second reading", "sd"),
    ("readings that are all the same", f"{CYLINDER} 27 27 27", "27", "sd", "n=3"),
    ("readings and a spread", f"{CYLINDER} 26.1 27 sd=0.8 n=5", "sd=0.8", "one mean"),
    ("half a reading", f"{CYLINDER} 26.1 sd=0.8 n=2.5", "n=2.5", "whole"),
    ("a spread above its mean", f"{CYLINDER} 26 sd=40 n=5", "sd=40", "less than the reading"),
    ("a table of masses", f"w {GRAIN} --measured masses.csv {RIG}", "masses.csv, line 2", "kg"),
    ("a picture of a fit", f"w {GRAIN} --measured a.fit.png {RIG}", "a.fit.png",
     "pictures of a fit"),
    ("a table that is not there", f"w {GRAIN} --measured angles.csv {RIG}", "angles.csv"),
    ("a table beside a reading", f"w {GRAIN} --measured angles.txt 27 {RIG}", "angles.txt",
     "all readings"),
    ("a picture twice", f"w {GRAIN} --measured same.png other.png {RIG}", "other.png", "once"),
    ("a sheet of nothing", f"{NEW} --sheet Mai", "--sheet Mai", "workbook"),
    # the rig of a test
    ("centimetres without a unit", f"{CYLINDER} 26.1 27 cylinder=6", "cylinder=6", "6 mm"),
    ("a narrow cylinder", f"{CYLINDER} 26.1 27 cylinder=6mm", "6 mm", "20 mm"),
    ("a misspelt key", f"{CYLINDER} 26.1 27 cylider=60mm", "cylider=60mm", "cylinder"),
    ("a key without its mark", f"{CYLINDER} 26.1 27 cylinder 60mm", "cylinder=VALUE", "one word"),
    ("a rig without readings", f"{CYLINDER} cylinder=60mm", "angle", "26.1"),
    ("a mass for a depth", f"{CYLINDER} 26.1 27 depth=80kg", "depth=80kg", "mm"),
    ("a plate under the cylinder", f"{CYLINDER} 26.1 27 cylinder=60mm plate=50mm", "plate=50mm",
     "60 mm"),
    ("a wall of rubber", f"{CYLINDER} 26.1 27 wall=rubber", "wall=rubber", "steel"),
    ("a lift like a shot", f"{CYLINDER} 26.1 27 speed=20m/s", "speed=20m/s", "2,000 mm/s"),
    ("two cylinders", f"{NEW} --lifted-cylinder 30 31 cylinder=80mm", "30", "one test"),
    ("a powder's cylinder", "w --density 2.7g/cm3 --grain 50um --lifted-cylinder 51 53",
     "--lifted-cylinder", "cylinder", "60 mm"),
    ("a narrow funnel", f"w {GRAIN} --funnel 26 27 orifice=12mm plate=100mm height=75mm",
     "orifice=12mm", "20 mm", "lifted cylinder"),
    ("a low funnel", f"w {GRAIN} --funnel 26 27 orifice=25mm plate=100mm height=20mm",
     "height=20mm", "24.9 mm"),
    ("a plate narrower than its orifice", f"w {GRAIN} --measured 26 27 --orifice 25mm --plate 2cm "
     "--height 75mm", "--plate 2cm", "25 mm"),
    ("a rim as high as the funnel", f"w {GRAIN} --measured 26.1 28.4 27 {RIG} --rim 60mm",
     "--height 75mm", "85.7 mm"),
    ("angles twice", f"w {GRAIN} --measured 26 28 --funnel 26 27 orifice=25mm plate=100mm "
     "height=75mm", "--measured", "--funnel"),
    ("a flood", f"w {GRAIN} --measured 26 27 {RIG} --rate 5000g/s", "--rate", "75.4 g/s"),
    # tests beside the heap
    ("a rebound above its drop", f"{NEW} --drop 310mm 300mm height=300mm", "310mm", "300 mm"),
    ("a restitution for a rebound", f"{NEW} --drop 0.51 0.52 height=300mm", "no unit", "mm"),
    ("a drop from nowhere", f"{NEW} --drop 78mm 80mm", "height", "300 mm"),
    ("a drop whose rebound is missing", f"{NEW} --drop drops.csv", "drops.csv, line 3", "rebound"),
    ("a rebound in metres", f"{NEW} --drop high.csv", "line 3", "0.3", "doubtful"),
    ("rebounds without a unit", f"{NEW} --drop bare.csv", "line 2, column rebound", "78",
     "no unit"),
    ("two columns of rebounds", f"{NEW} --drop twice.csv", "twice.csv, line 1", "rebound"),
    ("a wall beside a column of walls", f"{NEW} --drop walls.csv wall=steel height=300mm",
     "walls.csv", "wall"),
    ("single drops from two heights", f"{NEW} --drop 78mm height=300mm --drop 52mm height=200mm",
     "78mm", "52mm", "sd"),
    ("a friction for an angle", f"{NEW} --tilted-plane 0.38 0.39", "--tilted-plane 0.38", "rad"),
    ("two walls", f"{NEW} --drop 78mm 80mm height=300mm wall=steel --tilted-plane 21 22 wall=glass",
     "steel", "glass", "study for each"),
    ("single grains alone", f"w {GRAIN} --drop 78mm 80mm height=300mm", "angle of repose",
     "bulk density"),
    ("a powder that bounces", "w --density 2.7g/cm3 --grain 50um " + ANGLE
     + " --drop 78mm 80mm height=300mm", "--drop 78mm", "0.3 mm"),
    ("a bed denser than its grains", f"{NEW} --bulk-density 1400kg/m3 1410kg/m3", "1400kg/m3",
     "1320 kg/m3"),
    ("a bare bulk density in g/cm3", f"{NEW} --bulk-density 0.765 0.77", "0.765", "0.765 g/cm³"),
    ("a bed without pores", f"{NEW} --bulk-density 1.25g/cm3 1.26g/cm3", "1250 kg/m3", "1188"),
    ("a bed of air", f"{NEW} --tapped-density 0.3g/cm3 0.31g/cm3 taps=50", "300 kg/m3", "396"),
    ("taps that nobody counted", f"{NEW} --tapped-density 800kg/m3 810kg/m3", "taps", "100"),
    ("a bed that taps loosen", f"{NEW} --tapped-density 700kg/m3 705kg/m3 taps=100 "
     "--bulk-density 765kg/m3 770kg/m3", "700kg/m3", "765kg/m3"),
    ("a shear test without a load", f"{NEW} --shear-cell 1.9kPa 2.0kPa", "load", "2 kPa"),
    ("a stress that falls with its load", f"{NEW} --shear-cell 1.9kPa load=2kPa "
     "--shear-cell 1.5kPa load=4kPa --shear-cell 1kPa load=6kPa", "1 kPa under 6 kPa", "rises"),
    ("two stresses under one load", f"{NEW} --shear-cell 2kPa 3kPa load=5kPa --shear-cell 2kPa "
     "2.5kPa load=5kPa", "load 5 kPa"),
    ("an angle and a stress", f"{NEW} --wall-friction 1.1kPa 1.2kPa angle=15 load=4kPa",
     "one of the two"),
    ("a flow and its time", f"{NEW} --discharge 45g/s 46g/s time=3s orifice=60mm",
     "one of the two"),
    ("an arch", f"{NEW} --discharge 45g/s 46g/s orifice=9mm", "orifice=9mm", "20 mm"),
    ("a mass that would be tons",
     f"{NEW} --discharge time=6.3 sd=0.2 n=5 mass=500 orifice=25", "mass=500", "500 kg"),
    # rho 0.55 * 1320 kg/m3, clear opening 25 - 1.4 * 4 mm: 0.58 * 726 * 3.132 * 0.0194**2.5
    ("a flow that no orifice passes",
     f"{NEW} --discharge time=6.3s sd=0.2s n=5 mass=500kg orifice=25mm", "7.937e+04 g/s",
     "69.1 g/s", "138 g/s"),
    ("a trickle", f"{NEW} --discharge 5g/s 5.1g/s orifice=25mm", "5.05 g/s", "6.91"),
    ("a wall of dry grains", f"{CYLINDER} 70 71 cylinder=60mm", "70°", "60°", "moist"),
    ("a heap flatter than without friction", f"w {GRAIN} --measured 4 5 {RIG}", "4°", "5.8°"),
    # a table of tests
    ("a workbook that is not there", "w --from nothere.xlsx", "nothere.xlsx"),
    ("a table of one test", "w --from angles.txt", "angles.txt", "test", "angle"),
    ("a table of another kind", "--table tests.txt", "tests.txt", ".xlsx", ".csv"),
    ("a workbook that loses what was told", f"--table x.xlsx {GRAIN} {ANGLE}", "--from x.xlsx"),
]  # fmt: skip
