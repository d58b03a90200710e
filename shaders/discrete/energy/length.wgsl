// Length: Δs. Twin: src/discrete/energy/length.rs.

fn length_value(w: Window) -> real {
    return w.s0;
}

fn length_gradient(w: Window) -> Partials {
    var p = Partials();
    p.value = w.s0;
    p.s0 = real(1);
    return p;
}

fn length_hessian(w: Window) -> SecondPartials {
    return SecondPartials();
}
