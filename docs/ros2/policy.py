"""A policy for ratelab's cart-pole as a ROS 2 node would see it, without ROS: messages, keys
and attachments of rmw_zenoh, by the packages eclipse-zenoh and rosbags.

    python policy.py tcp/127.0.0.1:7447 [DOMAIN]
"""

import struct
import sys
import time
import uuid

import numpy
import zenoh
from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_JAZZY)
JOINT_STATE = "sensor_msgs/msg/JointState"
JointState = types.types[JOINT_STATE]


TYPE = f"sensor_msgs::msg::dds_::JointState_/{types.hash_rihs01(JOINT_STATE)}"


def key(domain, topic):
    return f"{domain}/{topic}/{TYPE}"


def publisher_token(session, domain, node, topic):
    """Tells others of a publisher: the run begins with the one of /action."""
    zid = session.info.zid()
    return f"@ros2_lv/{domain}/{zid}/0/1/MP/%/%/{node}/%{topic}/{TYPE}/::,1:,:,:,,"


def act(obs):
    """The force on the cart (N) for positions and velocities of cart and pole."""
    (x, angle), (v, omega) = obs.position, obs.velocity
    share = 10.0 * angle + 2.0 * omega + 0.4 * x + 0.8 * v
    return 10.0 * min(1.0, max(-1.0, share))


def main(address, domain):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{address}"]')
    config.insert_json5("connect/timeout_ms", "-1")
    config.insert_json5("scouting/multicast/enabled", "false")
    session = zenoh.open(config)
    actions, gid, sent = session.declare_publisher(key(domain, "action")), uuid.uuid4().bytes, 0

    def decide(sample):
        nonlocal sent
        obs = types.deserialize_cdr(sample.payload.to_bytes(), JOINT_STATE)
        none = numpy.array([])
        force = numpy.array([act(obs)])
        # The header goes back as it came: the age of the reading goes with it.
        action = JointState(obs.header, ["cart"], none, none, force)
        sent += 1
        attachment = struct.pack("<qqB", sent, time.time_ns(), len(gid)) + gid
        actions.put(types.serialize_cdr(action, JOINT_STATE).tobytes(), attachment=attachment)

    session.declare_subscriber(key(domain, "obs"), decide)
    # Held until the end: without it nobody knows that this node acts.
    token = session.liveliness().declare_token(publisher_token(session, domain, "policy", "action"))
    while token:
        time.sleep(1)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 0)
