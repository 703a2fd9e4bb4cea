"""Each robot takes the cheapest applicable task that nobody is heard to work on. python3 greedy.py --robot gold"""

from alliance_agent import Allocator, main


class Greedy(Allocator):
    def reset(self):
        self.claims = {}  # task -> {rank of a teammate: (since, last heard)}

    def step(self, now, heard, sets):
        for word in heard:
            for claims in self.claims.values():
                claims.pop(word.sender, None)  # a robot's latest word replaces those before
            if word.state == "executing":
                self.claims.setdefault(word.task, {})[word.sender] = (word.since, now)

        def rivals(it):  # those who are not silent for too long, by the age of their claim
            claims = self.claims.get(it.task, {}).items()
            return sorted((since, rank) for rank, (since, at) in claims if now - at < it.ceased_after)

        mine = next((it for it in sets if it.active), None)
        if mine and mine.applicable:
            earlier = [rival for rival in rivals(mine) if rival < (mine.since, self.rank)]
            if len(earlier) < mine.max_robots:
                return mine  # goes on; who claimed later gives way
        free = [it for it in sets if it.applicable and len(rivals(it)) < it.max_robots]
        return min(free, key=lambda it: (-it.priority, it.cost, it.id), default=None)


if __name__ == "__main__":
    main(Greedy)
