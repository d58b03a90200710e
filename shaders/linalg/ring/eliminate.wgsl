// Row `at` in terms of the kept unknown (alpha), of the next unknown (gamma), and a constant (delta).
// `share` is its own excess divided by its pivot. Loops over a chunk include this, and carry alpha,
// share and delta from row to row.
        let row = load_row(system, at);
        let own = row.excess + row.left * share;
        let link = row.left * alpha;
        let r = real(1) / (own + link + row.right);
        delta = (load_rhs(system, at) + row.left * delta) * r;
        alpha = link * r;
        share = own * r;
        let gamma = row.right * r;
