"""The words, letters and units in the names of channels, by what they mean."""

from typing import Literal

Quantity = Literal["position", "velocity", "acceleration", "effort"]
BY_UNIT: dict[str, Quantity] = {
    "rad": "position", "m": "position", "rad/s": "velocity", "m/s": "velocity", "rad/s^2": "acceleration",
    "m/s^2": "acceleration", "N": "effort", "N*m": "effort", "A": "effort", "V": "effort",
}  # fmt: skip
WORDS: dict[Quantity, frozenset[str]] = {
    "position": frozenset(
        "position positions pos angle angles theta phi psi alpha pose height distance displacement disp deflection extension "
        "length travel rotation translation posicion posizione posicao angulo angolo winkel weg lage".split()
    ),
    "velocity": frozenset("velocity velocities vel speed rate omega twist dq qd qdot thetadot dtheta xdot dx dy dz ydot zdot angvel gyro gyr gyroscope "
        "velocidad velocita velocidade vitesse geschwindigkeit drehzahl".split()),
    "acceleration": frozenset(
        "acceleration accelerations accel accl acceler acc linacc ddq qdd xddot ddx ddy ddz accelerometer aceleracion "
        "accelerazione aceleracao beschleunigung".split()
    ),
    "effort": frozenset(
        "effort efforts torque torques tor torq tau force forces wrench current currents cur curr voltage volt volts pwm duty trq "
        "moment iq drehmoment kraft strom spannung couple coppia fuerza forza forca esfuerzo sforzo esforco corriente corrente courant tensione tensao".split()
    ),
}  # fmt: skip
MOTIONS: tuple[Quantity, ...] = (
    "position",
    "velocity",
    "acceleration",
)  # each the derivative of the one before
DEVICES: dict[str, Quantity] = {
    "encoder": "position",
    "encoders": "position",
    "enc": "position",
    "load": "effort",  # of a load cell; the angle of a load is no effort
}  # quantities measured by a device, where no word states the quantity
# whose volts are those of a bridge, and no driving signal
GAUGES = frozenset("cell cells gauge gauges strain".split())
PULSED = frozenset("servo servos esc throttle pulse pulses".split())  # sent as the width of a pulse
LETTERS: dict[str, Quantity] = {  # conventional meaning of a single letter, where nothing else is stated
    "q": "position", "x": "position", "y": "position", "z": "position", "v": "velocity", "w": "velocity", "a": "acceleration",
    "u": "effort", "f": "effort", "i": "effort", "t": "effort",
}  # fmt: skip
# a name with a `d` before one of these is that of a derivative
MOTION = (
    WORDS["position"] | WORDS["velocity"] | {letter for letter, one in LETTERS.items() if one == "position"}
)
COMMANDED = frozenset(
    "des desired cmd cmds command commands commanded ref refs reference references target targets goal goals setpoint setpoints sp set "
    "demand demands demanded excitation request requests requested soll sollwert stell vorgabe ziel fuhrung fuehrung consigne consigna referencia riferimento".split()
)
COMMANDED_LETTERS = frozenset("u r".split())
# a controller's output, for an effort; the short words for a force also denote a contact's or a centre's
CONTROLLED = frozenset("controller controllers control controls ctrl contr ctl".split())
CONTROLLED_SHORT = frozenset("con ctr".split())
# commanded by a policy; in a topic it denotes a ROS action
COMMANDED_COLUMNS = frozenset(["action", "actions"])
MEASURED = frozenset(
    "meas measured sensed act actual applied state states observation feedback fb est estimated present real raw filt filtered smoothed response "
    "encoder encoders enc ist istwert mesure medido medida misurato".split()
)
# a sensor reading; among several efforts it is preferred to one that was filtered, estimated or modelled
READ = frozenset("meas measured act actual applied feedback fb present sensed".split())
PLACES = frozenset(
    "motor load link gear rotor shaft sensor imu camera vicon mocap optitrack laser lidar".split()
)
FORCING = frozenset("forcing pump pumping disturbance perturbation external stor stoer".split())
BASE = frozenset(
    "base table ground shaker platform floor road terrain foundation seismic earthquake quake".split()
)
SHAKEN = frozenset("excitation exc shaking vibration".split())  # words for a motion of the base
# driving signals, where no quantity is stated
DRIVING = frozenset("input in stimulus ctrl control drive entrada estimulo ingresso entree eingang".split())
FORCES = frozenset("force forces wrench".split())  # of a contact as well as of an actuator
GENERIC = frozenset(
    "dof joint joints motor data robot array value values actuator axis trajectory controller controllers in out input output "
    "salida saida uscita sortie ausgang grosse groesse".split()
)
JOINT = frozenset("joint joints".split())  # added by drivers to joint names arbitrarily
POSED = frozenset(
    "des desired ref refs reference references target targets goal goals setpoint setpoints sp soll sollwert vorgabe ziel fuhrung fuehrung "
    "consigne consigna referencia riferimento".split()
)  # for a motion, where nothing else is stated
MECHANICAL = FORCES | frozenset(
    "torque torques tor torq tau trq moment drehmoment kraft couple coppia fuerza forza forca".split()
)
DUTY = frozenset("pwm duty".split())  # of a bridge: it is set, no sensor measures it
ELECTRICAL = {
    "V": "voltage volt volts spannung tensione tensao",
    "A": "current currents cur curr iq amp amps i strom corriente corrente courant",
    "1": "pwm duty",
}
IN_SI = ("sensor_msgs/", "geometry_msgs/", "nav_msgs/", "tf2_msgs/", "trajectory_msgs/", "control_msgs/")
# values that a computer counts or sets; they neither drive nor follow
COUNTED = frozenset(
    "counter counters count counts id ids flag flags active enable enabled bit bits index idx seq sequence mask crc".split()
)
NO_EFFORT = COUNTED | frozenset("state states tcp tool flange pose".split())  # including the pose of a tool
WITH_MEANING = frozenset().union(
    COMMANDED, COMMANDED_COLUMNS, CONTROLLED, MEASURED, GENERIC, FORCING, BASE, SHAKEN, DRIVING, DEVICES, *WORDS.values()
)  # fmt: skip
# what a controller computes from the motion: its error, and the terms of that; no sensor measures them
COMPUTED = frozenset(
    "error errors err erreur fehler errore erro ecart abweichung regelabweichung regeldifferenz integral integrale integrator "
    "term terms pterm iterm dterm".split()
)
# parts of an effort that a controller computes from a model; the friction of a test rig may be measured
MODELLED = frozenset("gravity gravitational coriolis centrifugal centripetal".split())
IGNORED = COMPUTED | frozenset("temp temperature battery power status mode".split())
