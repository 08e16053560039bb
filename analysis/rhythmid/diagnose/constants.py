"""The constants that decide what is believed: evidence, rejections, verdict, and the choice between answers.

Each has its reason and, where there is one, its source. Numbers that stay beside their method, in this folder and below it, do
not decide what is believed of a hypothesis: they say how hypotheses are sought (which are fitted, from where, for how long),
how intervals are computed, and what is shown.
"""

# --- how predictions are scored -------------------------------------------------------------------------------------
# contiguous blocks of all records together: so many that the standard error of a gain is small although an effect acts in a
# tenth of them only (a stop, a large chirp), and
BLOCKS = 144
# rows of a block at least, so that each is longer than the noise remembers
# (J. Shao, J. Am. Stat. Assoc. 88 (1993) 486: cross-validation has to leave out much)
ROWS_OF_A_BLOCK = 12
# folds, into which the blocks are dealt in turn, so that every fold sees every amplitude (S. Geisser, Biometrika 62 (1975) 320)
FOLDS = 6
# blocks of each record at least, so that none is left out as a whole or decides alone
BLOCKS_OF_A_RECORD = 3
# passes of reweighted least squares in each fold: from the fit of all folds one moves the weights, two settle them
REWEIGHTED = 3
# draws of the Bayesian bootstrap: probabilities to about 0.01 (Y. Yao et al., Bayesian Analysis 13 (2018) 917)
DRAWS = 2000
# logarithm of the prior odds that each further effect costs: one in e (as Y. Yao et al. weigh models of unequal size)
EFFECT_PRIOR = 1.0

# --- what an effect has to bring ------------------------------------------------------------------------------------
# false-alarm rate of a further effect, over all candidates (C. E. Bonferroni)
FALSE_ALARM = 0.025
# odds that one block of data brings at most for an effect: strong evidence (R. E. Kass, A. E. Raftery, J. Am. Stat. Assoc. 90
# (1995) 773). An effect may act in few blocks, such as a limit that is met in fast moves; it is not believed for one of them
BLOCK_ODDS = 20.0
# share of what can still be explained that a further effect has to remove: less is a part of something else
# (real recordings: an axis, six arm joints, a frame, pendulums; shares of right effects were 0.3 and more)
REST = 0.2
# share of the whole mismatch that a further effect has to remove: a tenth of the motion that the first one changes.
# It keeps the effects of pairs, of which one may be thirty times the other in size
MISMATCH = 1e-3
# the same for a richer law in the place of one that it contains. A richer law takes up small effects that the model lacks, each 0.5 to 10 % of
# the main one, so up to a hundredth of its mean square (sealed cases: what laws that are richer than the true one remove is 0.0125 and less,
# what true ones do beyond a simpler one 0.033 and more)
RICHER = 0.02
# size of no practical matter, as a share of the motion (free run) or of the effort: a tenth of what real machines leave,
# whose models end at 2 to 5 % (measured: axis 2.1, arm joints 1.5 to 4.8, pendulums 0.5 to 0.75 %)
PRACTICAL = 0.003
# and of the effort, of which what a machine leaves is a larger share
PRACTICAL_EFFORT = 0.005
# standard errors within which a simpler or related law predicts as well (A. Vehtari, A. Gelman, J. Gabry, Stat. Comput. 27 (2017) 1413)
EQUIVALENT = 2.0

# of a bound, or of an effect, within which a value is taken to be there: rounding of a descent that stopped at it
EDGE = 1e-3
# resolved lines between an effect's frequency and a multiple of the forcing's, or that of a free motion: closer than the width of a line they are one
OWN_LINE = 1.0
# share of what an effect that changes with time does beyond the nominal model that no free map of the motion does: friction by direction
# taken for a fading actuator has 0.004 and less where the motion is made once, and any effect 0.13 and more where it comes again
RECURS = 0.05
# share of the effort that an actuator's effect leaves to move the machine: one that takes more than half explains no motion
MOVES = 0.5

# --- what a verdict needs -------------------------------------------------------------------------------------------
# joint probability of the names that an answer stands by
STATED = 0.8
# share of what free maps and names together explain that the names have to, for an answer to stand by them
EXPLAINED = 0.8
# the same, from which the names are the main part of it
MAINLY = 0.5
# chance that the catalogue holds the truth, as a function of what the names leave of all that anything explains: half at
# `ADEQUATE`, falling with its power `STEEPNESS` (fitted to sealed cases whose truth was in the catalogue or not: docs/proof.md)
ADEQUATE = 0.18
STEEPNESS = 1.5
# chance that the catalogue holds the truth where the names explain all, their sizes are known and no other name predicts as well
# (fitted to sealed cases, a quarter of whose laws the catalogue lacked: docs/proof.md)
HOLDS = 0.95
# chance that an effect whose size is open is that law and not only one of its limits, which a law that the catalogue lacks has as well
# (fitted to the same cases); and the standard deviation of a size, relative to the size, half-way to which it is open, with the power by
# which it gets so. Play that never closes is a gain, and a spring whose kink is out of reach a constant force. Of sealed names whose size had a
# deviation above 0.2 only 5 in 22 were right, and the family of 10
OPEN = 0.3
VAGUE = 0.2
VAGUENESS = 3.0
# prior odds of a family on real machines, over those with which the proof draws it. The proof draws all effects alike, real machines have
# friction. Of names that first runs stated on recordings of real machines (docs/real.md) 26 of 28 of friction were accepted, and 5 of 29 of other
# families: a ratio of the odds of 60. Some of the errors had causes that were corrected since, so that its square root is taken, to either side of one
PRIOR_ODDS = {"friction": 3.0}
PRIOR_ODDS_OF_OTHERS = 0.3
# share of what was measured that a model may miss in a way which follows from its own past, for an answer to say anything of it: a model that
# misses more than half describes another machine
MISSES_MOST = 0.5
# effect that the records would not show, as a share of what was measured, from which they decide nothing: as large as what
# the refitted model of a machine may leave and still be called identified
BLIND = 0.2
# standard deviations of the mean square of noise, above which an effect would show in it: by chance once in 30 000 records
SHOWS = 4.0

# --- how records are scored -----------------------------------------------------------------------------------------
# of the effort, up to which models of real machines leave it and no other way to score is tried (measured: 2 to 5 %, see `PRACTICAL`)
LEFT = 0.05
# effort, as a share of the inertial force, from which it is scored before windows are: it moves the machine against other forces.
# Where it is smaller the machine swings by itself, and the effort shows little of what else acts
DRIVES_IT = 1.0
# the same share, from which it is scored before a free run is: the motion is what is left of large forces that cancel, an error of the effort
# moves the machine far, and the effort itself says what it works against (inertia below a tenth of it)
QUASI_STATIC = 10.0
# error, as a share of the motion, below which a model follows the machine: a run that is lost altogether is wrong by 1 or more,
# and the effects of the proof at full size leave less than this
FOLLOWS = 0.3
# error of a free run, the same share, along which a score says nothing: hardly less than that of no motion at all
HOPELESS = 0.8
# share to which a step to shorter windows has to lower the error, and steps without such a gain before no more are tried: windows
# half as long have twice as many free starts, which lower it by less
BETTER_STEP, PATIENCE = 0.9, 2
# share to which all steps together have to: an error that adds up, not one made at once by noise or an effect
BETTER_TOGETHER = 0.6

# --- what calibration may take up -----------------------------------------------------------------------------------
# samples by which the input's delay may come out short of none, as one that is reconstructed otherwise than by holding does (by
# half of one), and up to which it is a nuisance that every log may have; a longer delay is a hypothesis of its own
EARLIEST, LATEST = 1.5, 2.5
# share to which a delay far from its start has to lower the error, or it but stands in for what is missing
STANDS_IN = 0.7
# standard deviations, and a share of a sample, by which a delay has to come out negative for the input not to have been held
NOT_HELD, NOT_HELD_LEAST = 4.0, 0.05
# standard deviations, and a share of the value, by which the records have to differ from a nominal value to contradict it
CONTRADICTS, CONTRADICTS_LEAST = 4.0, 0.02

# --- which other explanations compete -------------------------------------------------------------------------------
# laws of one quantity that are more likely a series for one law than causes of their own; two of them real springs have
SERIES = 3
# periods of the motion that a delay of the input may be: half a turn looks like another sign, so that a longer one is another
# minimum of the same
LONGEST_DELAY = 0.25
# times the ranges of the motion within which an effect has to be curved: no part of the motion exceeds them, nor what a limit
# has cut off; and those where every kink shows
REACH, FAR_RANGES = 1.2, 1e3
