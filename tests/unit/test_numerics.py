"""The study of the numerical choices is planned as its file says."""

from types import SimpleNamespace

import yaml

from calibration import Study
from calibration.intake.tables import read_written
from calibration.stages.numerics import plan_numerics


def test_a_variant_may_have_seeds_of_its_own(tmp_path):
    variants = {"coarse": {"run": {}}, "fine": {"against": "coarse", "seeds": 3, "run": {}}}
    points = {"low": {"salt_salt_restitution": 0.2}, "high": {"salt_salt_restitution": 0.7}}
    wanted = {"seeds": 2, "points": points, "variants": variants}
    (tmp_path / "numerics.yaml").write_text(yaml.safe_dump(wanted))
    source = SimpleNamespace(variants=tmp_path / "numerics.yaml")
    plan_numerics(Study("config"), source, SimpleNamespace(plan=tmp_path / "plan.json"))
    design = read_written(tmp_path / "design.csv")
    counts = design.groupby(["variant", "point"], sort=False).size()
    assert counts.to_dict() == {
        ("coarse", "low"): 2, ("coarse", "high"): 2, ("fine", "low"): 3, ("fine", "high"): 3,
    }  # fmt: skip
    assert not design.duplicated(["variant", "point", "seed"]).any()
