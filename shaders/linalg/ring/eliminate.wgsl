// Row `at` in terms of the kept unknown (alpha), the next one (gamma) and neither (delta); `share`
// is its own excess over its pivot. Stands inside the loops over a chunk, which carry alpha, share
// and delta from row to row.
        let row = load_row(system, at);
        let own = row.excess + row.left * share;
        let link = row.left * alpha;
        let r = real(1) / (own + link + row.right);
        delta = (load_rhs(system, at) + row.left * delta) * r;
        alpha = link * r;
        share = own * r;
        let gamma = row.right * r;
