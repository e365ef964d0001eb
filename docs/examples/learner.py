"""A manager that learns by trying at which altitude to search: an epsilon-greedy bandit."""

from suave_des import Threshold

SEARCH = "f_generate_search_path"
MODES = ("fd_spiral_low", "fd_spiral_medium", "fd_spiral_high")
PAIRS = [(murky, clear) for murky in MODES for clear in MODES]


class Learner(Threshold):
    """Searches in one mode while the visibility is below 2.25 m, and in another above; which ones is learned."""

    def recall(self, learned, training):
        """Choose a pair of modes for this mission."""
        self.totals = learned  # by pair of modes: missions, and the sum of their search times
        self.training = training
        if training:
            stream = self.system.stream("learner")
            untried = [pair for pair in PAIRS if self.key(pair) not in self.totals]
            self.pair = untried[0] if untried else stream.choice(PAIRS) if stream.random() < 0.3 else self.best()
        else:
            self.pair = self.best()

    def wanted(self, visibility_m):
        """The modes that fit, with the learned ones in the search."""
        for function, mode in super().wanted(visibility_m):
            murky, clear = self.pair
            yield function, mode if function != SEARCH else murky if (visibility_m or 9.0) < 2.25 else clear

    def mission_ended(self, metrics):
        """Note how long the search took."""
        if self.training:
            missions, total_s = self.totals.get(self.key(self.pair), (0, 0.0))
            self.totals[self.key(self.pair)] = [missions + 1, total_s + metrics.search_time_s]

    def best(self):
        """The pair with the shortest search so far."""

        def mean_s(pair):
            missions, total_s = self.totals.get(self.key(pair), (1, 300.0))
            return total_s / missions

        return min(PAIRS, key=mean_s)

    def key(self, pair):
        """A pair as a key of JSON."""
        return "/".join(pair)
