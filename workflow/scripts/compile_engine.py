from dem.precompile import compile_engine

compile_engine()
