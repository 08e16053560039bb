"""What `rhythmid` alone says: where to begin."""

BEGIN = """\
rhythmid finds out why a simulation
disagrees with a robot.

With a recording (a bag or a table):
  rhythmid init RECORDING
    guesses channels and a model
  rhythmid check RECORDING \\
    --signals signals.yaml
    says whether it can be used
  rhythmid diagnose RECORDING \\
    --signals signals.yaml \\
    --model model.yaml
    names the physics that is missing

With a recording and a simulation's:
  rhythmid diagnose REAL --sim SIMULATED

With neither:
  rhythmid table1
    repeats the paper's experiments

All commands:   rhythmid --help
One command:    rhythmid identify --help
Tab completion:
  rhythmid --install-completion
"""
