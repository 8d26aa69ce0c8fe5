"""A machine that speaks ROS 2, protected as a site would do it, among machines of others."""

from __future__ import annotations

from pathlib import Path

from tests.support.fort import BASE, Plan
from tests.support.ros2 import bench_in_ros2

DRIVER = "/cab/joy_driver"
"""The one node that may show itself as publisher of the inputs."""
_ACCESS = f"""
router: {{listen: [tls/PLACE], certificates: PKI/router}}
machines:
  - name: excavator
    base: {BASE}
    format: ros2
    ros2: {{transport: TRANSPORT}}
    joystick: /joy
    actuators: /excavator/joint_states
    NODES
  - name: other
    base: rampe/bench/other/guard
    joystick: rampe/bench/other/joystick
    actuators: rampe/bench/other/actuators
  - name: far
    base: rampe/bench/far/guard
    format: ros2
    ros2: {{transport: TRANSPORT, domain: 1, node: far_guard}}
    joystick: /far/joy
    actuators: /far/joint_states
access:
  - {{certificate: machine, role: machine, machines: [excavator]}}
  - {{certificate: guard, role: guard, machines: [excavator]}}
  - {{certificate: other, role: machine, machines: [other]}}
  - {{certificate: far, role: machine, machines: [far]}}
  - {{certificate: farguard, role: guard, machines: [far]}}
  - {{certificate: recorder, role: recorder}}
  - {{certificate: viewer, role: viewer}}
  - {{certificate: operator, role: operator}}
  - {{certificate: engineer, role: engineer}}
"""


def ros_plan(transport: str) -> Plan:
    """With that between ROS 2 and Zenoh."""
    nodes = f"ros2_nodes: [{DRIVER}]" if transport == "rmw_zenoh" else ""

    def site(folder: Path, more: str, name: str) -> Path:
        text = bench_in_ros2(folder, transport).read_text("utf-8")
        path = folder / f"{name}.yaml"
        path.write_text(f"{text}\n{more}\n", "utf-8")
        return path

    return Plan(_ACCESS.replace("TRANSPORT", transport).replace("NODES", nodes), BASE, site)
