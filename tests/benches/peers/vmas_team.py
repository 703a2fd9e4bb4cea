"""Robots that avoid each other and the walls in VMAS: vmas_team.py ROBOTS SECONDS

Prints the number of robot-steps and their processor time, s. A step is 50 ms. VMAS simulates a batch of small teams, because the time of a
step grows with the square of a team. The robots are therefore teams of ten in rooms of their own. A robot observes the positions of its team.
"""

import sys
import time

import torch
import vmas
from vmas.simulator.core import Agent, Sphere, World
from vmas.simulator.scenario import BaseScenario

TEAM = 10
RADIUS_M = 0.2
#: The half side of a room in which each robot has a share of 6 m times 6 m.
HALF_M = 3.0 * TEAM**0.5
NEAR_M = 0.8
SPEED_M_S = 0.5
WARM_UP = 20


class Wandering(BaseScenario):
    def make_world(self, batch_dim, device, **_):
        world = World(batch_dim, device, dt=0.05, x_semidim=HALF_M, y_semidim=HALF_M)
        for number in range(TEAM):
            world.add_agent(Agent(f"r{number}", shape=Sphere(RADIUS_M), max_speed=SPEED_M_S))
        return world

    def reset_world_at(self, env_index=None):
        shape = (2,) if env_index is not None else (self.world.batch_dim, 2)
        for number, agent in enumerate(self.world.agents):
            angle = 2 * torch.pi * number / TEAM
            place = torch.tensor([torch.pi / 2 - angle, angle]).sin() * HALF_M / 2
            agent.set_pos(place.expand(shape), env_index)

    def observation(self, agent):
        others = [other.state.pos - agent.state.pos for other in self.world.agents if other is not agent]
        return torch.cat([agent.state.pos, agent.state.vel, *others], -1)

    def reward(self, agent):
        return torch.zeros(self.world.batch_dim)


def act(seen, heading):
    """Returns the force of a robot: away from the nearest teammate, if that is near, else along its heading."""
    others = seen[:, 4:].unflatten(-1, (-1, 2))
    distances = others.norm(dim=-1)
    nearest = distances.argmin(-1, keepdim=True)
    away = -others.gather(1, nearest.unsqueeze(-1).expand(-1, 1, 2)).squeeze(1)
    heading = torch.where(seen[:, :2].abs() > HALF_M - NEAR_M, -seen[:, :2].sign(), heading)
    force = torch.where(distances.gather(1, nearest) < NEAR_M, away, heading)
    return force / force.norm(dim=-1, keepdim=True).clamp(min=1e-6), heading


def main(robots, seconds):
    torch.manual_seed(1)
    torch.set_num_threads(1)
    teams = max(1, robots // TEAM)
    env = vmas.make_env(Wandering(), num_envs=teams, device="cpu", continuous_actions=True, seed=1)
    seen = env.reset()
    headings = [torch.rand(teams, 2) * 2 - 1 for _ in range(TEAM)]
    steps, ticks, spent, began = 0, 0, 0.0, 0.0
    while ticks <= WARM_UP or spent < seconds:
        actions = []
        for number in range(TEAM):
            action, headings[number] = act(seen[number], headings[number])
            actions.append(action)
        seen = env.step(actions)[0]
        ticks += 1
        if ticks == WARM_UP:
            began = time.process_time()
        spent = time.process_time() - began
        steps = (ticks - WARM_UP) * teams * TEAM
    print(steps, spent)


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
