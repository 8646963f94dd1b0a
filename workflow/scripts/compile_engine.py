from dem.warm import compile_engine

compile_engine()
