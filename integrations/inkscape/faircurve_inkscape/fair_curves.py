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
        made, nodes = [], []
        for step in path.path.to_absolute().proxy_iterator():
            if step.letter == "M":
                made.append(nodes)
                nodes = [step.end_point]
            elif step.letter == "Z":
                if len(nodes) > 1 and nodes[0] == nodes[-1]:
                    nodes.pop()
                made.append([*nodes, None])
                nodes = nodes[:1]
            else:
                nodes.append(step.end_point)
        made.append(nodes)
        # After a Z the next subpath may begin where the last one did, or there may be none.
        closed_before = [False, *(bool(one) and one[-1] is None for one in made)]
        kept = [one for one, follows in zip(made, closed_before) if one and not (follows and len(one) == 1)]
        return " ".join("M" + " ".join("Z" if node is None else f"{node.x!r},{node.y!r}" for node in one) for one in kept)


if __name__ == "__main__":
    FairCurves().run()
