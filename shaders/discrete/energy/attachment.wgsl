// Attachment of a vertex to its data point: ½ w |f − p|², of which the kernel knows f − p and w.
// Twin: src/discrete/energy/attachment.rs.

fn attachment_value(offset: vector, stiffness: real) -> real {
    return real(0.5) * stiffness * dot(offset, offset);
}

fn attachment_gradient(offset: vector, stiffness: real) -> vector {
    return stiffness * offset;
}

fn attachment_hessian(stiffness: real) -> matrix {
    return diagonal(stiffness);
}
