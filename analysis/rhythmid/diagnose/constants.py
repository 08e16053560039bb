"""The constants that decide which hypotheses are believed: evidence, rejections, verdict, choice between answers.

Each has a reason and, where there is one, a source. Constants that stay beside their method, in this folder and below,
do not decide which hypothesis is believed. They control how hypotheses are sought (which are fitted, from which start, for
how long), how intervals are computed, and what is shown.
"""

# --- how predictions are scored -------------------------------------------------------------------------------------
# contiguous blocks of all records together: enough for a small standard error of a gain even where an effect acts in a
# tenth of them only (a stop, a large chirp)
BLOCKS = 144
# minimum rows of a block: each block is longer than the correlation time of the noise
# (J. Shao, J. Am. Stat. Assoc. 88 (1993) 486: cross-validation has to leave out much)
ROWS_OF_A_BLOCK = 12
# folds, to which the blocks are assigned in turn, so that each fold covers all amplitudes (S. Geisser, Biometrika 62 (1975) 320)
FOLDS = 6
# minimum blocks of each record, so that no record is left out as a whole or decides alone
BLOCKS_OF_A_RECORD = 3
# passes of reweighted least squares in each fold, starting from the fit of all folds: the first changes the weights, two more converge
REWEIGHTED = 3
# draws of the Bayesian bootstrap: resolve probabilities to about 0.01 (Y. Yao et al., Bayesian Analysis 13 (2018) 917)
DRAWS = 2000
# cost of each further effect, in logarithm of prior odds: odds of 1/e (Y. Yao et al. weigh models of unequal size in this way)
EFFECT_PRIOR = 1.0

# --- what an effect has to contribute -------------------------------------------------------------------------------
# false-alarm rate of a further effect, over all candidates (C. E. Bonferroni)
FALSE_ALARM = 0.025
# upper limit of the odds that one block can contribute for an effect: strong evidence (R. E. Kass, A. E. Raftery, J. Am. Stat.
# Assoc. 90 (1995) 773). An effect may act in few blocks, such as a limit reached in fast moves; one block is not enough
BLOCK_ODDS = 20.0
# share of the still explainable mismatch that a further effect has to remove: an effect that removes less is part of another
# one (real recordings: an axis, six arm joints, a frame, pendulums; correct effects had shares of 0.3 and more)
REST = 0.2
# share of the whole mismatch that a further effect has to remove: a tenth of the motion that the first effect changes.
# It keeps both effects of a pair of which one is up to thirty times as large as the other
MISMATCH = 1e-3
# the same for a richer law that replaces one that it contains. A richer law absorbs small effects that the model lacks. Each
# is 0.5 to 10 % of the main one, hence up to a hundredth of its mean square (sealed cases: laws richer than the true one
# remove at most 0.0125, true laws remove at least 0.033 beyond a simpler one)
RICHER = 0.02
# size below which an effect has no practical importance, as a share of the motion (free run): a tenth of the error that models
# of real machines leave, 2 to 5 % (measured: axis 2.1, arm joints 1.5 to 4.8, pendulums 0.5 to 0.75 %)
PRACTICAL = 0.003
# the same as a share of the effort, of which models of real machines leave a larger share
PRACTICAL_EFFORT = 0.005
# size from which a remainder that no name explains is unknown physics, as a share of the effort. Models of real machines leave 2 to 5 %
# of it, and a free function of the motion predicts part of that: filters, timing and sampling leave traces of the motion, too
UNNAMED_EFFORT = 0.02
# standard errors within which a simpler or related law counts as predicting equally well
# (A. Vehtari, A. Gelman, J. Gabry, Stat. Comput. 27 (2017) 1413)
EQUIVALENT = 2.0

# share of a bound, or of an effect, within which a value counts as being there: rounding of a descent that stopped at it
EDGE = 1e-3

# --- what a verdict needs -------------------------------------------------------------------------------------------
# joint probability from which names are stated
STATED = 0.8
# share of all that free maps and names together explain that the names must explain, for the names to be stated
EXPLAINED_BY_NAMES = 0.8
# half: share of an actuator's action from which it is more than a gain; share of the effort that an actuator's effect has to leave to
# move the machine; share of the measurement that a model may miss in a predictable way (from the residual's own past), beyond which it
# describes another machine
MAINLY = 0.5
# chance that the catalogue holds the truth, as a function of the unexplained share of the explainable mismatch: one half at
# `ADEQUATE`, falling with the power `STEEPNESS` (fitted to sealed cases whose truth was in the catalogue or not: docs/proof.md)
ADEQUATE = 0.18
STEEPNESS = 1.5
# share of the mismatch that small effects leave on average which the model lacks and no rule lets it name: the mean square of three that
# are 0.5 to 10 % of the main one, log-uniform (docs/proof.md, clutter), relative to its own
SMALL = 0.005
# chance that the catalogue holds the truth where the names explain everything, their sizes are known and no other name predicts
# as well (fitted to sealed cases, a quarter of whose laws the catalogue lacked: docs/proof.md)
HOLDS = 0.95
# OPEN: chance that an effect of undetermined size is the named law, and not only one of its limits, which a law outside the
# catalogue may share (fitted to the same cases). VAGUE: relative standard deviation of the size half-way to this chance;
# VAGUENESS: the power of the transition. Examples: play that never closes is a gain; a spring whose kink is out of reach is a
# constant force. Of 22 sealed names with a deviation above 0.2 only 5 were right, and the family of 10
OPEN = 0.3
VAGUE = 0.2
VAGUENESS = 3.0
# prior odds of a family on real machines, relative to the proof, which draws all effects equally often; those of other families
# are one. Of the first 28 names of friction that runs on recordings of real machines stated (docs/real.md), 26 were accepted: odds of
# 13, where the sealed cases from which `HOLDS` comes have 5
PRIOR_ODDS = {"friction": 3.0}
# smallest detectable effect, as a share of the measurement, from which the records decide nothing: as large as the error that
# the refitted model of a machine may leave and still count as identified
BLIND = 0.2
# standard deviations of the mean square of noise above which an effect is detectable: by chance once in 30 000 records
SHOWS = 4.0

# --- how records are scored -----------------------------------------------------------------------------------------
# share of the effort that models of real machines leave; up to it no other scoring mode is tried, unless something is left without a
# name or a band was not compared (measured: 2 to 5 %, see `PRACTICAL`)
LEFT = 0.05
# ratio of effort to inertial force from which effort is scored before windows: the effort moves the machine against other
# forces. With a smaller effort the machine swings by itself, and the effort shows little of the other forces
DRIVES_IT = 1.0
# the same ratio, from which effort is scored before a free run. The motion is then a small difference of large forces, so that a
# small error of the effort moves the machine far; the effort itself shows the forces it works against (inertia is below a tenth)
QUASI_STATIC = 10.0
# error, as a share of the motion, below which a model follows the machine: a run that has lost the machine has an error of 1 or
# more, and the effects of the proof at full size leave less than this
FOLLOWS = 0.3
# the same error of a free run, from which its score carries no information: hardly less than the error of predicting no motion
HOPELESS = 0.8
# ratio to which a step to shorter windows must lower the error, and the number of steps without such a gain after which the
# search stops. Windows half as long have twice as many free initial states, which alone lower the error by less
BETTER_STEP, PATIENCE = 0.9, 2
# ratio to which all steps together must lower it: this shows an error that accumulates, not one that noise or an effect makes at once
BETTER_TOGETHER = 0.6

# --- what calibration may absorb ------------------------------------------------------------------------------------
# [samples] the longest delay that counts as a nuisance: every log may have a short delay; a longer one is a hypothesis of its own
LATEST = 2.5
# ratio to which a delay far from its start must lower the error; otherwise it is only a surrogate for missing physics
STANDS_IN = 0.7
# the records contradict a nominal value if they differ by this many standard deviations (by chance once in 30 000 records) and this
# share of the value; for the delay of an input that is taken for held, this share of a sample
CONTRADICTS, CONTRADICTS_LEAST, NOT_HELD_LEAST = 4.0, 0.02, 0.05

# --- which other explanations compete -------------------------------------------------------------------------------
# number of laws of one quantity from which they more likely approximate one law than act separately; real springs have two
SERIES = 3
# periods of the motion up to which an input delay is sought: a delay of half a period looks like a change of sign, so that a longer
# one is another minimum of the same fit
LONGEST_DELAY = 0.25
