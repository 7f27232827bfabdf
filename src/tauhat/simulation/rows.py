"""Which quantity stands in which row of a plant's arrays, (n_rows, n_v) each.

One array of many rows, and not an array for each quantity: Numba then compiles the kernels in 15 s instead of 26.
`MachineState` and `Drives` give the rows their names back in Python.
"""

from __future__ import annotations

# State. The first twelve are the channels of a log, in the order of `running.CHANNELS`: the begin of the last step.
Q, DQ, DDQ, TAU, DRY, LAW, MOTOR, MOTOR_DQ, MOTOR_DDQ, GEAR, TEMPERATURE, EXTERNAL = range(12)
CHANNEL_COUNT = 12
SHAFT, SHAFT_DQ, LOAD, WARMTH, PUSHED, FRICTION, SLOPE, SPRING = range(12, 20)
# What a law sees and adds to, five rows together: see `JointState`.
SEEN, SEEN_DQ, SEEN_LOAD, PART, PART_SLOPE = range(20, 25)
# Scratch of a step.
VISCOUS, COULOMB, IMPEDANCE, PUSH, STANDS, MOVED, SPEED = range(25, 32)
# One joint that stands for a motor of two, the rows of `JointState` again.
SINGLE = 32
STATE_ROWS = 37

# Constants of the drives; the last n_v rows are the inertia of motors that turn with two joints.
OFFSET, OWN_VISCOUS, OWN_COULOMB, ROTOR, STIFFNESS, SPRING_DAMPING, HALF_GAP, SHARED = range(8)

# Constants of the thermal states; from SLOPES on, those of viscous, Coulomb and the laws' friction.
DECAY, RISE, SLOPES = range(3)

# A tracking law in the kernel; the last three change.
KP, KD, KI, LIMIT, ENCODER_STEP, INTEGRAL, READ, READ_DQ = range(8)
STEERING_ROWS = 8
