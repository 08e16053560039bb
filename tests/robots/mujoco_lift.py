"""A robot that shares nothing with our plant: MuJoCo moves a carriage on a vertical guide, which a pump shakes.

    python tests/robots/mujoco_lift.py --ros-args -r __ns:=/lift -p friction:=1.5

A process of its own with names, rates and types of its own. The carriage hangs on the joint `lift` (spring and damper) and
bears a balanced `wheel` that turns by itself. It publishes `joint_states` of both at 500 Hz and the pump's force as WrenchStamped
on `pump` at 250 Hz; commands come on `commands` as Float64MultiArray (wheel, lift), Float64 or JointState, and hold until the next.
A command acts when it arrives, whatever the load of the machine: the robot lives some milliseconds in the past, and the
middleware tells when each one came.

What can be concealed, by parameters: `friction`, the contact with a floor, a `filter` of the actuator, a `delay` of commands.
"""

from __future__ import annotations

import math
import time
from collections import deque
from contextlib import suppress
from typing import Any

import mujoco
import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy._rclpy_pybind11 import RCLError
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

MASS, STIFFNESS, DAMPING = 2.0, 800.0, 8.0  # kg, N/m, N s/m
PUMP_FORCE, PUMP_FREQUENCY = 6.0, 1.4  # N, Hz
PERIOD_NS, PUMP_EVERY = 2_000_000, 2
BEHIND_NS = 5_000_000  # how far in the past the robot lives, for all that arrived to be in its hands
STEP = 5e-4  # s, the longest of an integration
SOFT = 1e-4  # MuJoCo's impedance of a contact: as small as it gets, the contact is a spring and a damper
EFFECTS = {  # what can be concealed: N, N/m, damping ratio, m, s, s
    "friction": 0.0, "floor_stiffness": 0.0, "floor_damping_ratio": 0.3, "floor": -0.045, "filter": 0.0, "delay": 0.0,
}  # fmt: skip
MODEL = """
<mujoco>
  <option timestep="{STEP}" gravity="0 0 -9.81" integrator="RK4"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1" pos="0 0 {floor_height}" contype="{contact}" conaffinity="{contact}"
          condim="1" solref="-{contact_stiffness} -{contact_damping}" solimp="{SOFT} {SOFT} .001 .5 1" priority="1"/>
    <body name="carriage">
      <joint name="lift" type="slide" axis="0 0 1" stiffness="{STIFFNESS}" damping="{DAMPING}" springref="0"
             frictionloss="{friction}" solreffriction=".002 1"/>
      <inertial mass="{carriage}" pos="0 0 0" diaginertia=".01 .01 .01"/>
      <geom name="foot" type="sphere" size=".01" contype="{contact}" conaffinity="{contact}" condim="1"/>
      <body name="wheel">
        <joint name="wheel" type="hinge" axis="1 0 0"/>
        <inertial mass=".5" pos="0 0 0" diaginertia=".002 .001 .001"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="motor" joint="lift" dyntype="{dynamics}" dynprm="{filter}"/>
    <motor name="pump" joint="lift"/>
    <velocity name="turner" joint="wheel" kv=".1"/>
  </actuator>
</mujoco>
"""


class Machine:
    """The physics: `advance(until, force)` holds a force [N] on the carriage until a time [s]."""

    def __init__(self, effects: dict[str, float]) -> None:
        stiffness = effects["floor_stiffness"] or 1.0
        # MuJoCo takes the mean of a body's inverse weight over three directions, and this one moves along one
        weight = SOFT + (1.0 - SOFT) / 3.0
        given = effects | {
            "STEP": STEP,
            "STIFFNESS": STIFFNESS,
            "DAMPING": DAMPING,
            "carriage": MASS - 0.5,
            "contact": int(effects["floor_stiffness"] > 0.0),
            "floor_height": effects["floor"] - 0.01,
            "SOFT": SOFT,
            "contact_stiffness": stiffness / MASS * weight,
            "contact_damping": 2.0 * effects["floor_damping_ratio"] * math.sqrt(stiffness / MASS) * weight,
            "dynamics": "filter" if effects["filter"] > 0.0 else "none",
        }
        self._model = mujoco.MjModel.from_xml_string(MODEL.format(**given))
        self._data = mujoco.MjData(self._model)
        self._data.qpos[0] = -9.81 * MASS / STIFFNESS
        self._data.ctrl[2] = 3.0  # rad/s of the wheel

    def advance(self, until: float, force: float) -> None:
        """Hold `force` [N] until the time [s]."""
        self._data.ctrl[0] = force
        while (left := until - self._data.time) > 1e-9:
            self._model.opt.timestep = left / math.ceil(left / STEP - 1e-9)
            self._data.ctrl[1] = self.pump(self._data.time + 0.5 * self._model.opt.timestep)
            mujoco.mj_step(self._model, self._data)

    @staticmethod
    def pump(at: float) -> float:
        """The pump's force [N]."""
        return PUMP_FORCE * math.cos(2.0 * math.pi * PUMP_FREQUENCY * at)

    @property
    def state(self) -> tuple[list[float], list[float]]:
        """Positions [m, rad] and velocities of lift and wheel."""
        return self._data.qpos.tolist(), self._data.qvel.tolist()


class Lift(Node):
    """The robot's computer: takes commands, moves the machine, publishes what its sensors say."""

    def __init__(self) -> None:
        super().__init__("lift_driver")
        self.effects = {name: self.given(name, value) for name, value in EFFECTS.items()}
        self.noise = self.given("noise", 1e-4)  # m
        self.types = {"Float64MultiArray": Float64MultiArray, "Float64": Float64, "JointState": JointState}
        self.kind = self.types[self.given("command_type", "Float64MultiArray")]
        self.random = np.random.default_rng(self.given("seed", 0))
        self.machine = Machine(self.effects)
        self.states = self.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
        self.pump = self.create_publisher(WrenchStamped, "pump", 10)
        self.commands = self.create_subscription(self.kind, "commands", lambda _: None, 1000)
        self.arrived: deque[tuple[int, float]] = deque()  # [ns], [N]
        self.acted: list[int] = []  # ns
        self.force, self.samples = 0.0, 0
        self.start_ns = time.time_ns() // PERIOD_NS * PERIOD_NS

    def given(self, name: str, default: Any) -> Any:
        """A parameter's value."""
        return self.declare_parameter(name, default).value

    def live(self) -> None:
        """Take what has arrived, and catch up with the present."""
        now_ns = time.time_ns() - BEHIND_NS
        while taken := self.commands.handle.take_message(self.kind, False):
            self.take(*taken)
        while (sample_ns := self.start_ns + (self.samples + 1) * PERIOD_NS) <= now_ns:
            while self.arrived and self.arrived[0][0] <= sample_ns:
                act_ns, force = self.arrived.popleft()
                self.advance(act_ns)
                self.force = force
                self.acted.append(act_ns)
            self.advance(sample_ns)
            self.samples += 1
            self.tell(sample_ns)

    def take(self, message: Any, about: dict[str, int]) -> None:
        """Note a command, and when it will act."""
        if isinstance(message, JointState):
            force = message.effort[list(message.name).index("lift")]
        else:
            force = message.data if isinstance(message, Float64) else message.data[1]
        self.arrived.append((about["received_timestamp"] + round(1e9 * self.effects["delay"]), force))

    def advance(self, until_ns: int) -> None:
        self.machine.advance(1e-9 * (until_ns - self.start_ns), self.force)

    def tell(self, stamp_ns: int) -> None:
        """Publish what belongs to this time."""
        (lift, wheel), velocity = self.machine.state
        state = JointState(
            name=["wheel", "lift"], position=[wheel, lift + self.random.normal(0.0, self.noise)]
        )
        state.velocity = velocity[::-1]
        state.header.stamp.sec, state.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        self.states.publish(state)
        if self.samples % PUMP_EVERY == 0:
            wrench = WrenchStamped(header=state.header)
            wrench.wrench.force.z = self.machine.pump(1e-9 * (stamp_ns - self.start_ns))
            self.pump.publish(wrench)


def main() -> None:
    rclpy.init()
    robot = Lift()
    log = robot.given("log", "")  # file for the times [ns] at which commands acted: the truth of the delay
    with suppress(KeyboardInterrupt):
        while robot.context.ok():
            try:
                robot.live()
            except RCLError:  # the robot is switched off between two messages
                if robot.context.ok():
                    raise
            time.sleep(0.5e-9 * PERIOD_NS)
    if log:
        np.save(log, np.array(robot.acted))


if __name__ == "__main__":
    main()
