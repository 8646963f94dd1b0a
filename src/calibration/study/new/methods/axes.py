"""Axes of a grain, measured with a caliper: length, width, and thickness where it was."""

from calibration.study.new.methods.declare import Method, Question

METHOD = Method(
    name="axes",
    title="Axes",
    about="Length, width and thickness of single grains with a caliper, a row a grain. They become "
    "a clump of spheres. Without a thickness a grain is as thick as wide.",
    questions=(
        Question("length", "longest axis", "diameter_mm", reading=True, needed=True,
                 example="6.2 mm"),
        Question("width", "middle axis", "diameter_mm", reading=True, needed=True,
                 example="3.3 mm"),
        Question("thickness", "shortest axis", "diameter_mm", reading=True,
                 example="2.9 mm"),
    ),
    rank=1,
)  # fmt: skip
