"""A manager for suave-des that trusts the measured visibility less than it might."""

from suave_des import Threshold


class Cautious(Threshold):
    """Searches as high as the visibility allows that is left when a margin is taken off the
    measured one.
    """

    def wanted(self, visibility_m):
        """The modes that fit a visibility that is lower by the setting `margin_m`."""
        margin_m = self.system.settings.get("margin_m", 0.5)
        return super().wanted(None if visibility_m is None else visibility_m - margin_m)
