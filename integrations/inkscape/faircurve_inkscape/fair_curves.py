"""Fair curves through the nodes of paths."""

from paths import MARKED, PathExtension


class FairCurves(PathExtension):
    def add_arguments(self, pars):
        pars.add_argument("--method", default="fair")
        pars.add_argument("--tension", type=float, default=1.0)
        self.add_length(pars, "tolerance", 0.05)

    def commands(self):
        # Natural splines are cubics, and exact without a tolerance.
        options = [] if self.options.method == "natural" else ["--tolerance", self.length("tolerance", "Tolerance")]
        if self.options.method == "scf":
            options += ["--tension", repr(self.options.tension)]
        return [["fit", "--as", "bezier", "--method", self.options.method, "--topology", "no", *MARKED, *options]]

    def data(self, path):
        """The polygon of the nodes, open or closed as the path is."""
        subpaths = []
        for step in path.path.to_absolute().proxy_iterator():
            if step.letter == "M":
                subpaths.append(([step.end_point], []))
            elif step.letter == "Z":
                subpaths[-1][1].append("Z")
            else:
                if subpaths[-1][1]:
                    # What follows a Z begins where the closed subpath did.
                    subpaths.append((subpaths[-1][0][:1], []))
                subpaths[-1][0].append(step.end_point)
        words = []
        for nodes, end in subpaths:
            if end and len(nodes) > 1 and nodes[0].is_close(nodes[-1]):
                nodes.pop()
            words.append("M" + " ".join([*(f"{node.x!r},{node.y!r}" for node in nodes), *end[:1]]))
        return " ".join(words)


if __name__ == "__main__":
    FairCurves().run()
