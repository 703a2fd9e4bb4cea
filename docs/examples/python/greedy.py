"""Greedy allocator: each robot takes the cheapest applicable task without enough robots. python3 greedy.py --robot gold"""

from alliance_sim import Allocator, main


class Greedy(Allocator):
    def reset(self):
        self.claims = {}  # task -> {rank of a teammate: (start, time of the last message)}

    def step(self, now, messages, sets):
        for message in messages:
            for claims in self.claims.values():
                claims.pop(message.sender, None)  # the latest message of a robot replaces the earlier ones
            if message.state == "executing":
                self.claims.setdefault(message.task, {})[message.sender] = (message.since, now)

        def rivals(option):  # teammates with a claim that are not lost, oldest claim first
            claims = self.claims.get(option.task, {}).items()
            return sorted((since, rank) for rank, (since, at) in claims if now - at < option.ceased_after)

        mine = next((option for option in sets if option.active), None)
        if mine and mine.applicable:
            earlier = [rival for rival in rivals(mine) if rival < (mine.since, self.rank)]
            if len(earlier) < mine.max_robots:
                return mine  # the oldest claims have priority
        free = [option for option in sets if option.applicable and len(rivals(option)) < option.max_robots]
        return min(free, key=lambda option: (-option.priority, option.cost, option.id), default=None)


if __name__ == "__main__":
    main(Greedy)
