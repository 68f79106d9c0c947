"""Python client of nido: a robot, or any port of a running system (docs/python.md).

    import nido
    with nido.Robot("icubSim") as robot:
        robot.head.set_position("neck_yaw", 20, wait_s=5)
        picture = robot.camera("left").read()
"""
from .errors import Error, NotFound, Refused, Timeout
from .robot import Camera, Image, Joint, Part, Robot
from .system import Message, Reader, System

__all__ = ["Camera", "Error", "Image", "Joint", "Message", "NotFound", "Part", "Reader", "Refused", "Robot", "System",
           "Timeout"]
