"""Controls a live run as a node of ROS would, with a package by others.

    ros_services.py DOMAIN PROGRAM RUN ARGUMENT...

The script is the router and the node, and starts `PROGRAM run ARGUMENT... --ros-control --paused --out RUN`. It calls
the services, sends orders on `/alliance/control`, and sends garbage to both. Prints facts as JSON.
"""

import json
import sys
import threading
import time

import zenoh
from ros_topics import PATIENCE, STORES, Subscriber, equal, finish, free_port, open_session, run_script, start
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_typestore
from zenoh_ros2_sdk.service_client import ROS2ServiceClient

TRIGGER = "std_srvs/srv/Trigger"
TEXT = "std_msgs/msg/String"
TEXT_KEY = "std_msgs::msg::dds_::String_"


def service_hash():
    """Returns the hash of the service type by `rosbags`, which knows messages only: a service is a message of its parts.

    ROS reads `char` in definitions as `uint8`, and `rosbags` does not.
    """

    def part(name):
        return Nodetype.NAME, name

    def optional(name):
        return Nodetype.SEQUENCE, (part(name), 1)

    store, event = get_typestore(STORES[1]), "service_msgs/msg/ServiceEventInfo"
    request, response = f"{TRIGGER}_Request", f"{TRIGGER}_Response"
    info = [(name, (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16)) if name == "client_gid" else of) for name, of in store.fielddefs[event][1]]
    store.fielddefs |= {
        event: ([], info),
        request: ([], []),
        response: ([], [("success", (Nodetype.BASE, ("bool", 0))), ("message", (Nodetype.BASE, ("string", 0)))]),
        f"{TRIGGER}_Event": ([], [("info", part(event)), ("request", optional(request)), ("response", optional(response))]),
        TRIGGER: ([], [("request_message", part(request)), ("response_message", part(response)), ("event_message", part(f"{TRIGGER}_Event"))]),
    }
    return store.hash_rihs01(TRIGGER)


class Node:
    def __init__(self, port, domain, graph):
        self.port, self.domain, self.graph = port, domain, graph
        self.store = get_typestore(STORES[1])
        self.session = open_session("client", port)
        self.replies = []
        self.has_reply = threading.Event()
        self.text_hash = self.store.hash_rihs01(TEXT)
        self.subscription = self.session.declare_subscriber(self.text_key("replies"), self.take)

    def text_key(self, name):
        return f"{self.domain}/alliance/{name}/{TEXT_KEY}/{self.text_hash}"

    def take(self, sample):
        equal(len(sample.attachment.to_bytes()), 33, "attachment of a reply")
        self.replies.append(json.loads(self.store.deserialize_cdr(sample.payload.to_bytes(), TEXT).data))
        self.has_reply.set()

    def wait_for(self, service):
        """Waits for the token of a service."""
        part, until = "/SS/%/%/alliance/" + service.replace("/", "%") + "/", time.monotonic() + PATIENCE
        while not any(part in token for token in self.graph.tokens):
            if time.monotonic() > until:
                sys.exit(f"there is no service {service}: {sorted(self.graph.tokens)}")
            time.sleep(0.05)

    def call(self, service):
        """Calls a service. Returns whether it succeeded, and its message."""
        definitions = {"request_definition": "uint8 structure_needs_at_least_one_member", "response_definition": "bool success\nstring message"}
        client = ROS2ServiceClient(service, TRIGGER, domain_id=int(self.domain), router_port=self.port, timeout=PATIENCE, **definitions)
        response = client.call(structure_needs_at_least_one_member=0)
        key = client.keyexpr
        client.close()
        if response is None:
            sys.exit(f"{service} did not answer")
        return key, [response.success, response.message]

    def order(self, text):
        """Sends an order. Returns the reply."""
        self.has_reply.clear()
        message = self.store.types[TEXT](data=text)
        self.session.put(self.text_key("control"), bytes(self.store.serialize_cdr(message, TEXT)))
        if not self.has_reply.wait(PATIENCE):
            sys.exit(f"there was no reply to {text}")
        return self.replies[-1]


def main(domain, program, run, *arguments):
    port = free_port()
    _router = open_session("router", port)
    graph = Subscriber(port, domain)
    process = start(program, run, port, domain, [*arguments, "--ros-control", "--paused"])
    node = Node(port, domain, graph)
    node.wait_for("/gold/restart")
    hashes = {token.split("/")[11] for token in graph.tokens if "/SS/" in token}
    equal(hashes, {service_hash()}, "type hashes of the services")
    facts = {"services": sorted(token.split("/")[9].replace("%", "/") for token in graph.tokens if "/SS/" in token)}
    key, facts["step"] = node.call("/alliance/step")
    # Requests and orders that are none have no effect: no attachment, no message, no command.
    for payload, attachment in [(b"", None), (b"\x00\x01\x00\x00\x00", None), (b"garbage", bytes(33)), (b"\x00\x01\x00\x00\x00", bytes(40))]:
        equal(list(node.session.get(key, payload=payload, attachment=attachment, target=zenoh.QueryTarget.ALL, timeout=1)), [], "replies")
    for payload in (b"garbage", bytes(node.store.serialize_cdr(node.store.types[TEXT](data="{}"), TEXT))):
        node.session.put(node.text_key("control"), payload)
    facts["refused"] = node.order('{"fault": {"fault": {"kill": "nobody"}}}')
    facts["armed"] = node.order('{"fault": {"fault": {"mute": "blue"}, "at_s": 3.0, "for_s": 1.0}}')
    facts["kill"] = node.call("/gold/kill")[1]
    facts["resume"] = node.call("/alliance/resume")[1]
    facts["stderr"] = finish(process)
    print(json.dumps(facts))


if __name__ == "__main__":
    run_script(main)
