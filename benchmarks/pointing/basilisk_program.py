"""The pointing spacecraft in Basilisk's own C++ and C modules; run by beside_basilisk.py under an interpreter with bsk.

    python basilisk_program.py PARAMETERS.json {record,bare,plant} TRAJECTORY.npz [--simple-nav]

Prints one line of JSON. `record` has a recorder for each message that a recording of the project holds, `bare` none, and in
`plant` the spacecraft runs alone, without its flight software. Navigation passes on the true attitude: by a module of four
lines compiled by Basilisk's NumbaModel where numba is installed, else (or with --simple-nav) by simpleNav, which also draws
and propagates its 18 errors, of covariance zero.
"""

import json
import sys
import time

import numpy as np
from Basilisk import __version__
from Basilisk.architecture import bskLogging, messaging
from Basilisk.fswAlgorithms import attTrackingError, inertial3D, mrpFeedback, rwMotorTorque
from Basilisk.simulation import extForceTorque, reactionWheelStateEffector, simpleNav, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW

try:
    from Basilisk.architecture.numbaModel import NumbaModel
except ImportError:
    NumbaModel = None


def true_attitude():
    """A compiled module that copies attitude and rates of the state's message."""
    class TrueAttitude(NumbaModel):
        def __init__(self):
            super().__init__()
            self.scStateInMsg = messaging.SCStatesMsgReader()
            self.attOutMsg = messaging.NavAttMsg()

        @staticmethod
        def UpdateStateImpl(scStateInMsgPayload, attOutMsgPayload):  # noqa: N802
            for i in range(3):
                attOutMsgPayload.sigma_BN[i] = scStateInMsgPayload.sigma_BN[i]
                attOutMsgPayload.omega_BN_B[i] = scStateInMsgPayload.omega_BN_B[i]

    return TrueAttitude()


def assembled(given, with_simple_nav=False, plant_alone=False):
    """The simulation, the messages of one tick by what the project calls them, and what has to be kept alive."""
    plant, gains, wheels = given["plant"], given["feedback"], "wheel_inertia" in given["plant"]
    sim = SimulationBaseClass.SimBaseClass()
    sim.CreateNewProcess("process").addTask(sim.CreateNewTask("task", macros.sec2nano(given["period_s"])))

    def added(module, tag, priority):
        module.ModelTag = tag
        if tag == "body" or not plant_alone:
            sim.AddModelToTask("task", module, priority)
        return module

    body = spacecraft.Spacecraft()
    body.hub.mHub, body.hub.IHubPntBc_B = plant["mass"], plant["inertia"]
    body.hub.r_CN_NInit, body.hub.v_CN_NInit = plant["position"], plant["velocity"]
    body.hub.sigma_BNInit, body.hub.omega_BN_BInit = plant["sigma"], plant["omega"]
    added(body, "body", 80)

    outside = added(extForceTorque.ExtForceTorque(), "outside", 95)
    outside.extForce_B, outside.extTorquePntB_B = column(plant["force"]), column(plant["disturbance"])
    body.addDynamicEffector(outside)

    if with_simple_nav or NumbaModel is None:
        navigation, by = added(simpleNav.SimpleNav(), "navigation", 70), "simpleNav"
    else:
        navigation, by = added(true_attitude(), "navigation", 70), "a NumbaModel"
    navigation.scStateInMsg.subscribeTo(body.scStateOutMsg)

    reference = added(inertial3D.inertial3D(), "reference", 60)
    reference.sigma_R0N = given["reference"]["sigma"]

    tracking = added(attTrackingError.attTrackingError(), "tracking", 50)
    tracking.attNavInMsg.subscribeTo(navigation.attOutMsg)
    tracking.attRefInMsg.subscribeTo(reference.attRefOutMsg)

    feedback = added(mrpFeedback.mrpFeedback(), "feedback", 40)
    feedback.K, feedback.P, feedback.Ki, feedback.integralLimit = gains["k"], gains["p"], -1.0, 0.0
    feedback.guidInMsg.subscribeTo(tracking.attGuidOutMsg)
    configuration = messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(
        ISCPntB_B=sum(gains["inertia"], start=[])))
    feedback.vehConfigInMsg.subscribeTo(configuration)

    found = {"truth": body.scStateOutMsg, "attitude": navigation.attOutMsg, "reference": reference.attRefOutMsg,
             "error": tracking.attGuidOutMsg, "torque": feedback.cmdTorqueOutMsg}
    kept = [body, outside, navigation, reference, tracking, feedback, configuration]
    if wheels:
        factory = simIncludeRW.rwFactory()
        for axis, speed in zip(plant["axes"], plant["wheel_speeds"], strict=True):
            factory.create("custom", axis, Js=plant["wheel_inertia"], Omega=speed / macros.RPM, Omega_max=1e5,
                           useMaxTorque=False, RWModel=messaging.BalancedWheels)
        effector = added(reactionWheelStateEffector.ReactionWheelStateEffector(), "wheels", 90)
        factory.addToSpacecraft("wheels", effector, body)
        arrangement = factory.getConfigMessage()
        feedback.rwParamsInMsg.subscribeTo(arrangement)
        feedback.rwSpeedsInMsg.subscribeTo(effector.rwSpeedOutMsg)
        allocation = added(rwMotorTorque.rwMotorTorque(), "allocation", 30)
        allocation.controlAxes_B = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        allocation.rwParamsInMsg.subscribeTo(arrangement)
        allocation.vehControlInMsg.subscribeTo(feedback.cmdTorqueOutMsg)
        effector.rwMotorCmdInMsg.subscribeTo(allocation.rwMotorTorqueOutMsg)
        found.update(wheels=effector.rwSpeedOutMsg, motors=allocation.rwMotorTorqueOutMsg)
        kept += [factory, effector, arrangement, allocation]
    else:
        outside.cmdTorqueInMsg.subscribeTo(feedback.cmdTorqueOutMsg)
    return sim, found, by, kept


def column(numbers):
    return [[number] for number in numbers]


def main() -> None:
    given = json.loads(open(sys.argv[1], encoding="utf-8").read())
    recorded, trajectory = sys.argv[2] == "record", sys.argv[3]
    bskLogging.setDefaultLogLevel(bskLogging.BSK_ERROR)
    began = time.perf_counter()
    sim, found, navigation, _kept = assembled(given, "--simple-nav" in sys.argv, sys.argv[2] == "plant")
    logs = {name: message.recorder() for name, message in found.items()} if recorded else {}
    for log in logs.values():
        sim.AddModelToTask("task", log, 0)
    sim.InitializeSimulation()
    start_s = time.perf_counter() - began
    sim.ConfigureStopTime(given["ticks_of_warm_up"] * macros.sec2nano(given["period_s"]))
    sim.ExecuteSimulation()
    wall, cpu = time.perf_counter(), time.process_time()
    sim.ConfigureStopTime(given["ticks"] * macros.sec2nano(given["period_s"]))
    sim.ExecuteSimulation()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    if recorded:
        truth = logs["truth"]
        parts = [truth.r_BN_N, truth.v_BN_N, truth.sigma_BN, truth.omega_BN_B]
        if "wheels" in logs:
            parts.append(np.array(logs["wheels"].wheelSpeeds)[:, :3])
        np.savez(trajectory, t_ns=truth.times(), state=np.hstack(parts))
    print(json.dumps({"wall_s": wall, "cpu_s": cpu, "start_s": start_s, "version": __version__,
                      "navigation": navigation, "ticks": given["ticks"] - given["ticks_of_warm_up"]}))


if __name__ == "__main__":
    main()
