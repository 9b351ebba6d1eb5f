"""The parts of `make test`. tools/run_tests.py starts it.

- outcome: counts of tests, and what one test came to and cost
- outputs: reads what each kind of runner prints
- graph: steps that need each other, run beside each other
- rust: compiles the workspace once, and lists its test programs
- plan: the steps of each tier
- catalogue: which test runs in which tier; a test of neither is an error
- costs: what each step and each test cost
"""
