"""The paper's law, Eq. (3) to (13), as a controller in Python.

Fly it with ``ringwing run paper-4.2 --agent "all=python3 examples/controllers/paper.py"``. It adds and multiplies in the order of the
built-in law, and its flight is the same to the bit. Another order rounds differently. That changes the last digit of a force, and the first
seconds of a flight, when UAVs pass each other closely, magnify it to tenths of a millimetre.
"""

from __future__ import annotations

import math

import ringwing

#: A vector in the plane, as a complex number: x is its real part. Python computes with these faster than with short arrays.
Vector = complex

#: The nearest distance to the edge of an obstacle that Eq. (13) is used with. Nearer, it would grow without limit.
NEAREST_M = 0.01


def direction(heading_rad: float) -> Vector:
    return complex(*ringwing.direction(heading_rad))


def dot(a: Vector, b: Vector) -> float:
    return a.real * b.real + a.imag * b.imag


def length(vector: Vector) -> float:
    # ``abs`` of a complex number rounds in another way.
    return math.sqrt(dot(vector, vector))


class Paper(ringwing.Controller):
    def __init__(self, start: ringwing.Start) -> None:
        control = start.scenario["control"]
        self.gain = control["formation_gain"]
        self.slot_gain = control["slot_gain"]
        self.obstacle_gain_m = control["obstacle_gain_m"]
        self.heading_gain = control["heading_gain_rad_per_m"]

    def step(self, s: ringwing.Situation) -> ringwing.Wish:
        if s.leader is None or s.slot_m is None:
            return ringwing.Wish(s.speed_m_s, 0.0)
        own = complex(*s.position_m)
        # f_v of Eq. (5), less f_i of Eq. (4), plus f_obs of Eq. (13).
        speed_force = direction(s.leader.heading_rad) * s.leader.track.speed_m_s
        repulsion = sum((self.repulsion(obstacle, own) for obstacle in s.obstacles), 0j)
        formation_force = self.formation_force(s, own)
        force = speed_force - formation_force + repulsion
        # Eq. (6): the part along the heading is the speed, the part across it the turn rate. ringwing cuts both, Eq. (11).
        along = direction(s.heading_rad)
        across = complex(-along.imag, along.real)
        # The log of the built-in law has its forces. A law of one's own notes what its log is to have.
        notes = {"formation_force_m": length(formation_force)}
        return ringwing.Wish(dot(along, force), self.heading_gain * dot(across, force), notes)

    def formation_force(self, s: ringwing.Situation, own: Vector) -> Vector:
        """f_i of Eq. (4): towards the right distances from both neighbours and from the centre, and towards the slot."""
        assert s.leader is not None and s.slot_m is not None
        force = 0j
        for neighbour in (s.previous, s.next):
            if neighbour is not None and neighbour.track is not None:
                # What a neighbour sends takes a tick to arrive, so predict it by one tick and not more.
                position_m, _ = neighbour.track.after(min(neighbour.track.age_s, s.period_s))
                force += self.bond(own - complex(*position_m), neighbour.rest_m)
        force += self.bond(own - complex(*s.leader.position_m), s.radius_m)
        return force + (own - complex(*s.slot_m)) * self.slot_gain

    def bond(self, apart: Vector, rest_m: float) -> Vector:
        """A term of Eq. (4) with G: zero at the distance ``rest_m``."""
        distance_m = length(apart)
        # Two at the same place have no direction to push each other.
        return apart / distance_m * (self.gain * (distance_m - rest_m)) if distance_m > 0 else 0j

    def repulsion(self, obstacle: ringwing.Obstacle, own: Vector) -> Vector:
        """f_obs of Eq. (13), within the braking distance."""
        apart = own - complex(*obstacle.position_m)
        distance_m = length(apart)
        if not 0 < distance_m <= obstacle.braking_distance_m:
            return 0j
        to_edge_m = max(distance_m - obstacle.radius_m, NEAREST_M)
        return apart / distance_m * (self.obstacle_gain_m * (obstacle.braking_distance_m - distance_m) / to_edge_m)


if __name__ == "__main__":
    ringwing.main(Paper)
