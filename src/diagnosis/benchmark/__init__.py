"""The benchmark of the diagnosis: effects hidden in data of the engine, and what is found of
them."""
