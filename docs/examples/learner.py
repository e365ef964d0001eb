"""A manager that learns by trying in which mode to search: an epsilon-greedy bandit."""

from suave_des import Threshold

SEARCH = "f_generate_search_path"
MODES = ("fd_spiral_low", "fd_spiral_medium", "fd_spiral_high")


class Learner(Threshold):
    """Searches in one mode, whatever the visibility; which one is learned."""

    def recall(self, learned, training):
        # by mode: missions, and the sum of their search times
        self.learned, self.training = (
            learned,
            training,
        )
        stream = self.system.stream("learner")
        untried = [mode for mode in MODES if mode not in learned]
        if training and (untried or stream.random() < 0.3):
            self.mode = stream.choice(untried or MODES)
        else:
            self.mode = min(learned, key=lambda mode: learned[mode][1] / learned[mode][0])

    def wanted(self, visibility_m):
        for function, mode in super().wanted(visibility_m):
            yield function, self.mode if function == SEARCH else mode

    def mission_ended(self, metrics):
        if self.training:
            missions, total_s = self.learned.get(self.mode, (0, 0.0))
            self.learned[self.mode] = [missions + 1, total_s + metrics.search_time_s]
