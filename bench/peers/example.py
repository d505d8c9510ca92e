"""A peer for `ringwing bench --peer` over Unix sockets: the contract of bench/PEERS.md in Python."""

import argparse
import socket
import struct
import sys
import time

END = -1  # the number of the "tick" that ends the run


def now_ns():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def message(tick, size):
    """A message of `size` bytes that begins with its tick."""
    return struct.pack("<q", tick).ljust(size, b"\1")


def save(path, records):
    with open(path, "wb") as file:
        for record in records:
            file.write(struct.pack("<4q", *record))


class World:
    def __init__(self, args):
        self.args, self.tick, self.records = args, 0, []
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        listener.bind(args.dir + "/world.socket")
        listener.listen(args.uavs)
        self.agents = [listener.accept()[0] for _ in range(args.uavs)]

    def run(self):
        self.run_ticks(self.args.warm_up)
        self.report("warm")
        self.run_ticks(self.args.seconds)
        self.report("done")
        for agent in self.agents:
            agent.send(message(END, self.args.bytes_out))
        save(self.args.dir + "/world.trace", self.records)

    def report(self, line):
        """Prints a line, and waits until ringwing has read what all processes have used."""
        print(line, flush=True)
        sys.stdin.readline()

    def run_ticks(self, seconds):
        period_ns = 1_000_000_000 // self.args.rate if self.args.rate else 0
        due_ns = now_ns() + period_ns
        end_ns = now_ns() + int(seconds * 1e9)
        # A tick that was due in time still runs, however late it begins.
        while (due_ns if period_ns else now_ns()) < end_ns:
            while period_ns and now_ns() < due_ns:
                time.sleep(max(0, due_ns - now_ns()) / 1e9)
            opened_ns = now_ns()
            self.exchange()
            self.records.append((self.tick, due_ns, opened_ns, now_ns()))
            self.tick += 1
            if period_ns:
                # Skip the due times that had already passed when the tick was opened.
                due_ns += (1 + (opened_ns - due_ns) // period_ns) * period_ns

    def exchange(self):
        out = message(self.tick, self.args.bytes_out)
        for agent in self.agents:
            agent.send(out)
        for agent in self.agents:
            answer = agent.recv(self.args.bytes_back)
            if len(answer) != self.args.bytes_back:
                sys.exit("an agent is gone")


def run_agent(args):
    world = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    while world.connect_ex(args.dir + "/world.socket"):
        time.sleep(0.002)  # the world is not listening yet
    records = []
    while True:
        received = world.recv(args.bytes_out)
        woke_ns = now_ns()
        if not received:
            sys.exit("the world is gone")
        (tick,) = struct.unpack_from("<q", received)
        if tick == END:
            break
        read_ns = now_ns()
        answer = message(tick, args.bytes_back)
        records.append((tick, woke_ns, read_ns, now_ns()))
        world.send(answer)
    save(f"{args.dir}/agent-{args.uav}.trace", records)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--role", choices=["world", "agent"], required=True)
    parser.add_argument("--uav", type=int)
    parser.add_argument("--dir", required=True)
    for name in ["--uavs", "--rate", "--bytes-out", "--bytes-back"]:
        parser.add_argument(name, type=int, required=True)
    for name in ["--warm-up", "--seconds"]:
        parser.add_argument(name, type=float, required=True)
    args = parser.parse_args()
    if args.role == "world":
        World(args).run()
    else:
        run_agent(args)


main()
