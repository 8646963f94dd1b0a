"""The page of a diagnosis: how a verdict is told. What was found is `diagnosis.verdict`'s."""
