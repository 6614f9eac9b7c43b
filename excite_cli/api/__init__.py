"""What the commands do, for scripts and notebooks; the only front door to the packages below.

Every function takes what an earlier one gave and returns a frozen record; nothing is kept. Paths
may be `str` or `Path`; bad input is an `ExciteError` with one sentence. What is worth saying on the
way goes to a `Tell`, by default the logger "excite".

    problem = load_problem("configs/ur10.yaml")
    result = plan(problem)                              # excite optimize
    recording = simulate(problem, result)               # excite simulate, or: load_data(problem, …)
    found = diagnose(problem, recording.dataset)        # excite diagnose

Matrices here are small, and several BLAS threads make them slower: set OPENBLAS_NUM_THREADS=1
before Python starts. (The program takes one thread by itself.)

One module per command, imported at its first use: `import excite_cli` and `excite --help` stay
light.
"""
