"""The client against a robot without a body and its gateway: everything that docs/python.md tells."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import nido

BIN = os.environ["NIDO_BIN"]
DOMAIN = 60 + os.getpid() % 40


def becomes_true(condition, limit_s=20.0):
    until = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(0.02)
    return True


def processes_with(text):
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as file:
                if text.encode() in file.read().replace(b"\0", b" "):
                    found.append(int(pid))
        except OSError:
            pass
    return found


class FakeRobot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = subprocess.Popen([os.path.join(BIN, "nido-robot"), "fake", "--domain", str(DOMAIN)],
                                       stdout=subprocess.DEVNULL)
        cls.robot = nido.Robot("icubSim", domain=DOMAIN, timeout_s=20)
        for part in nido.robot.PARTS:
            cls.robot.system.wait_for(f"/icubSim/{part}/rpc:i")

    @classmethod
    def tearDownClass(cls):
        cls.robot.close()
        cls.program.send_signal(signal.SIGINT)
        cls.program.wait(20)

    def test_ports_are_listed(self):
        ports = self.robot.system.ports("/icubSim/head")
        self.assertTrue({"/icubSim/head/rpc:i", "/icubSim/head/command:i", "/icubSim/head/state:o"} <= set(ports), ports)
        self.assertEqual([], [one for one in self.robot.system.ports() if "python" in one])

    def test_joints_have_names_and_limits(self):
        arm = self.robot.left_arm.joints
        self.assertEqual(len(arm), 16)
        self.assertTrue(all(joint.min_deg < joint.max_deg and joint.max_speed_deg_s > 0 for joint in arm))
        self.assertEqual(len({joint.name for joint in arm}), 16)

    def test_a_part_goes_where_it_is_told(self):
        head = self.robot.head
        head.set_speeds(100)
        head.set_positions([-10, 5, 15.5, 0, 0, 5], wait_s=10)
        for is_deg, wanted_deg in zip(head.positions(), [-10, 5, 15.5, 0, 0, 5]):
            self.assertAlmostEqual(is_deg, wanted_deg, delta=0.2)
        name = head.joints[2].name
        head.set_position(name, -20, wait_s=10)
        self.assertAlmostEqual(head.positions()[2], -20, delta=0.2)
        self.assertTrue(becomes_true(lambda: abs(head.read().value[2] + 20) < 0.2))
        self.assertEqual(len(head.velocities()), 6)
        head.stop()

    def test_a_stream_moves_a_part_and_ends_by_itself(self):
        torso = self.robot.torso
        begin = torso.positions()[0]
        with torso.states() as states:
            until = time.monotonic() + 20
            while time.monotonic() < until and states.latest().value[0] < begin + 1:
                torso.command("velocity", [20, 0, 0])
        self.assertGreater(torso.positions()[0], begin + 0.9)
        self.assertTrue(becomes_true(lambda: abs(torso.velocities()[0]) < 0.01))

    def test_states_come_in_order(self):
        with self.robot.right_arm.states() as states:
            messages = [states.read() for _ in range(20)]
        self.assertEqual(sorted({one.count for one in messages}), [one.count for one in messages])
        self.assertTrue(all(a.time_s < b.time_s for a, b in zip(messages, messages[1:])))
        self.assertTrue(all(len(one.value) == 16 for one in messages))

    def test_cameras_and_touch(self):
        camera = self.robot.camera("left")
        first, second = camera.read(), camera.read()
        self.assertLess(first.time_s, second.time_s)
        self.assertEqual(len(first.data), 3 * first.width * first.height)
        self.assertGreater(len(set(first.data)), 4)
        with tempfile.TemporaryDirectory() as folder:
            first.save(os.path.join(folder, "left.png"))
            with open(os.path.join(folder, "left.png"), "rb") as file:
                self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")
        self.assertEqual(list(self.robot.touch("right")), ["thumb", "index", "middle", "ring", "little", "palm"])

    def test_the_world_answers_with_values(self):
        # this robot's world has nothing in it
        self.assertEqual(self.robot.world("num box"), [0])
        with self.assertRaisesRegex(nido.Refused, "no simulated world"):
            self.robot.world("mk box 0.04 0.04 0.04 0 0.6 0.3 1 0 0")

    def test_somebody_speaks_to_the_robot(self):
        with self.robot.system.reader("/icubSim/mic:o") as ears:
            self.robot.say("grasp red ball")
            # a sound is (frames, channels, bytes a sample, samples a second, samples); the noise of the room is below 500
            self.assertTrue(becomes_true(lambda: max(map(abs, ears.read().value[4])) > 5000))
        with self.assertRaises(nido.Refused):
            self.robot.say("x" * 201)

    def test_any_port_is_read_and_written(self):
        info = self.robot.system.read("/icubSim/cam/left/camera_info:o").value
        self.assertEqual(info["width"], self.robot.camera("left").read().width)
        self.assertEqual(len(info["k"]), 9)
        with self.assertRaises(nido.Refused):
            self.robot.system.write("/icubSim/head/command:i", mode="flying")

    def test_what_is_wrong_is_told(self):
        with self.assertRaisesRegex(nido.Error, "head has no joint 'neck': neck_pitch"):
            self.robot.head.set_position("neck", 1)
        with self.assertRaisesRegex(nido.Error, "head has 6 joints, not 2"):
            self.robot.head.set_positions([1, 2])
        with self.assertRaisesRegex(nido.Refused, "joint 99"):
            self.robot.head.ask("get enc 99")
        with self.assertRaisesRegex(nido.NotFound, "/icubSim/tail/rpc:i"):
            self.robot.system.ask("/icubSim/tail/rpc:i", "get encs", timeout_s=0.2)
        with self.assertRaises(nido.Error):
            self.robot.head.set_position(0, float("nan"))
        # and the connection lives on
        self.assertEqual(len(self.robot.head.positions()), 6)

    def test_a_killed_program_leaves_no_gateway(self):
        script = f"import nido, sys, time; nido.System(domain={DOMAIN}); print('up', flush=True); time.sleep(100)"
        for end in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT):
            program = subprocess.Popen([sys.executable, "-B", "-c", script], stdout=subprocess.PIPE,
                                       stderr=subprocess.DEVNULL)
            self.assertEqual(program.stdout.readline(), b"up\n")
            self.assertEqual(len(processes_with(f"sh {BIN}/nido-gateway --name python_{program.pid}_")), 1)
            program.send_signal(end)
            program.wait(20)
            program.stdout.close()
            self.assertTrue(becomes_true(lambda: not processes_with(f"--name python_{program.pid}_")))


if __name__ == "__main__":
    unittest.main()
