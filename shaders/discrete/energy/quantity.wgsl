// The penalty of a quantity, from $NAME_quantity and $NAME_second.
// Twin: src/discrete/energy/penalty.rs.
//:once include discrete/energy/penalty.wgsl

fn $NAME_value(w: Window) -> real {
    return penalty_value(w.penalty$PENALTY, $NAME_quantity(w).value);
}

fn $NAME_gradient(w: Window) -> Partials {
    return penalty_gradient(w.penalty$PENALTY, $NAME_quantity(w));
}

fn $NAME_hessian(w: Window) -> SecondPartials {
    let first = $NAME_quantity(w);
    return penalty_hessian(w.penalty$PENALTY, first, $NAME_second(w, first));
}
