"""Smooth paths of few nodes."""

import inkex
from paths import MARKED, PathExtension


def nodes(data):
    """The number of nodes of path data."""
    return sum(len(subpath) for subpath in inkex.Path(data).to_superpath())


class FewerNodes(PathExtension):
    def add_arguments(self, pars):
        self.add_length(pars, "within", 1.0)
        pars.add_argument("--corners", default="auto")
        pars.add_argument("--angle", type=float, default=60.0)

    def commands(self):
        within = self.length("within", "Within")
        corners = f"{self.options.angle!r}deg" if self.options.corners == "angle" else self.options.corners
        # The first sees through noise, the second needs fewer nodes for clean curves.
        return [["draw", "--within", within, "--corners", corners, *MARKED], ["bezier", "--simplify", "--tolerance", within]]

    def chosen(self, given, made):
        return min([given, *made], key=nodes)


if __name__ == "__main__":
    FewerNodes().run()
