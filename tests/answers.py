"""The answer of a study that nobody made, for tests of what is made from it."""

from calibration.telling.answer.schema import Answer, Next, Parameter, Runs, Test, Wrong

ANSWER = Answer(
    study="x", engine="0", by="chain", beside=[],
    parameters=[
        Parameter(key="contacts.particle_particle.rolling_friction", name="factor a", symbol="µr",
                  value=1.0376, unit="", interval_95=(0.8, 1.3), interval_of="one test",
                  bounded=True, source="calibrated"),
        Parameter(key="law_parameters.surface_energy_J_m2", name="factor b", symbol="γ",
                  value=0.5376, unit="J/m²", interval_95=(0.05, 1.9), interval_of="one test",
                  bounded=False, source="calibrated"),
        Parameter(key="contacts.particle_wall.restitution", name="restitution", symbol="e",
                  value=0.421, unit="", interval_95=None, interval_of=None, bounded=None,
                  source="published"),
    ],
    tests=[
        Test(test="drop", metric="rebound_height_mm", setting={"drop_height_mm": 150.0}, unit="mm",
             measured=20.5, error=0.45, n=5, predicted=26.6, predicted_sd=0.01, interval_95=None,
             runs=4, pull=-13.6, p=1e-4, state="missed", note=""),
        Test(test="tilt", metric="sliding_angle_deg", setting={}, unit="deg", measured=35.8,
             error=0.2, n=5, predicted=35.7, predicted_sd=0.1, interval_95=None, runs=4, pull=0.4,
             p=1.0, state="met", note=""),
    ],
    wrong=Wrong(verdict="missed", p=1e-4, laws=[], rows=["drop"], instead=[],
                sentence="The drop is missed."),
    next=Next(test="plane", metric="sliding_angle_deg", readings=5, hours=0.5,
              parameter="factor_b", left=0.3),
    runs=Runs(made=3, failed=0, seconds=1.0),
)  # fmt: skip
