// The fence of a quantity, from $NAME_quantity and $NAME_second. Twin: src/discrete/energy/fence.rs.
//:once include discrete/energy/fence.wgsl

fn $NAME_value(w: Window) -> real {
    return fence_value(w.fence$FENCE, $NAME_quantity(w).value);
}

fn $NAME_gradient(w: Window) -> Partials {
    return fence_gradient(w.fence$FENCE, $NAME_quantity(w));
}

fn $NAME_hessian(w: Window) -> SecondPartials {
    let first = $NAME_quantity(w);
    return fence_hessian(w.fence$FENCE, first, $NAME_second(w, first));
}
