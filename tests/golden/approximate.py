"""Messages with the closest stamps: a model that shares no code with the crate.

The rules are those of `approximate_time.hpp` (message_filters 361e42c), with its default age
penalty. Stamps are whole microseconds.

    python3 approximate.py          writes approximate.txt: 300 random sequences and their sets
    python3 approximate.py 5000     prints that many, for
                                    RATELAB_APPROXIMATE=FILE cargo test approximate

A sequence is a line of words, and the line below it has its sets: `WHEN:N+N` for the message
(from 1) that completed it, and the number of its message within each topic (from 0).

    topics=N queue=N interval=US or - messages=TOPIC:STAMP,...
"""

import random
import sys


class Matcher:
    def __init__(self, topics, queue, interval):
        self.queue, self.interval = queue, interval
        self.deque = [[] for _ in range(topics)]    # (stamp, number)
        self.past = [[] for _ in range(topics)]
        self.dropped = [False] * topics
        self.pivot = None
        self.sets = []

    def add(self, topic, stamp, number):
        self.deque[topic].append((stamp, number))
        if len(self.deque[topic]) == 1 and all(self.deque):
            self.process()
        if len(self.deque[topic]) + len(self.past[topic]) > self.queue:
            self.recover()
            self.deque[topic].pop(0)
            self.dropped[topic] = True
            if self.pivot is not None:
                self.pivot = None
                if all(self.deque):
                    self.process()

    def recover(self):
        self.deque = [past + deque for past, deque in zip(self.past, self.deque)]
        self.past = [[] for _ in self.deque]

    def ends(self, times):
        """The first of the earliest, and the last of the latest."""
        start, end = 0, 0
        for topic, time in enumerate(times):
            if time < times[start]:
                start = topic
            if time >= times[end]:
                end = topic
        return start, end

    def candidate(self, start, end):
        self.best = [deque[0][1] for deque in self.deque]
        self.past = [[] for _ in self.deque]
        self.from_, self.to = start, end

    def move(self, topic):
        self.past[topic].append(self.deque[topic].pop(0))

    def publish(self):
        self.sets.append(self.best)
        self.pivot = None
        self.recover()
        for deque in self.deque:
            deque.pop(0)

    def process(self):
        while all(self.deque):
            times = [deque[0][0] for deque in self.deque]
            first, last = self.ends(times)
            start, end = times[first], times[last]
            for topic in range(len(self.deque)):
                if topic != last:
                    self.dropped[topic] = False
            if self.pivot is None:
                if (self.interval is not None and end - start > self.interval
                        or self.dropped[last]):
                    self.deque[first].pop(0)
                    continue
                self.candidate(start, end)
                self.pivot, self.pivot_time = last, end
            elif 11 * (end - self.to) < 10 * (start - self.from_):
                self.candidate(start, end)
            self.move(first)
            limit = 10 * (self.pivot_time - self.from_)
            if first == self.pivot or 11 * (end - self.to) >= limit:
                self.publish()
            elif not all(self.deque):
                self.imagine(limit)

    def imagine(self, limit):
        """Whether the earliest messages that may come can make a better set."""
        deque, past = [list(d) for d in self.deque], [list(p) for p in self.past]
        while True:
            times = [
                deque[0][0] if deque else max(past[-1][0], self.pivot_time)
                for deque, past in zip(self.deque, self.past)
            ]
            first, last = self.ends(times)
            if 11 * (times[last] - self.to) >= limit:
                self.publish()
                return
            if 11 * (times[last] - self.to) < 10 * (times[first] - self.from_):
                self.deque, self.past = deque, past
                return
            self.move(first)


def case(number):
    dice = random.Random(number)
    topics, queue = dice.randint(1, 4), dice.choice([1, 2, 3, 5, 10])
    interval = dice.choice([None, None, 20, 100])
    jitter, strides = dice.choice([0, 10, 60, 200]), [dice.randint(1, 4) for _ in range(topics)]
    stamps, counts, messages, sets = [0] * topics, [0] * topics, [], []
    matcher = Matcher(topics, queue, interval)
    for time in range(1, 61):
        topic = dice.choices(range(topics), strides)[0]
        stamp = max(stamps[topic], 10 * time - dice.randint(0, jitter))
        stamps[topic] = stamp
        messages.append(f"{topic}:{stamp}")
        matcher.add(topic, stamp, counts[topic])
        counts[topic] += 1
        sets += [f"{time}:" + "+".join(map(str, chosen)) for chosen in matcher.sets]
        matcher.sets = []
    interval = "-" if interval is None else interval
    return (f"topics={topics} queue={queue} interval={interval} "
            f"messages={','.join(messages)}\nsets={','.join(sets)}\n")


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    text = "\n".join(case(number) for number in range(count))
    if len(sys.argv) > 1:
        print(text, end="")
    else:
        with open(__file__.replace(".py", ".txt"), "w") as file:
            file.write(text)


if __name__ == "__main__":
    main()
