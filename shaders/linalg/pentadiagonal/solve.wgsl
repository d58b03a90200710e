// Solves for $W right-hand sides in place at x. No twin: see pentadiagonal.wgsl.
fn $NAME(diagonal: u32, first: u32, second: u32, n: u32, x: u32) {
    var one = vec$W<real>();
    var two = vec$W<real>();
    for (var i = 0u; i < n; i++) {
        var l1 = real(0);
        var l2 = real(0);
        if (i >= 1u) {
            l1 = scratch[first + i - 1u];
        }
        if (i >= 2u) {
            l2 = scratch[second + i - 2u];
        }
//:unroll c 0..$W
        let here$c = scratch[x + i * $Wu + $cu] - l2 * two[$c] - l1 * one[$c];
        scratch[x + i * $Wu + $cu] = here$c;
        two[$c] = one[$c];
        one[$c] = here$c;
//:end
    }
    one = vec$W<real>();
    two = vec$W<real>();
    for (var k = n; k > 0u; k--) {
        let i = k - 1u;
        let inverse = scratch[diagonal + i];
        var l1 = real(0);
        var l2 = real(0);
        if (i + 1u < n) {
            l1 = scratch[first + i];
        }
        if (i + 2u < n) {
            l2 = scratch[second + i];
        }
//:unroll c 0..$W
        let here$c = scratch[x + i * $Wu + $cu] * inverse - l2 * two[$c] - l1 * one[$c];
        scratch[x + i * $Wu + $cu] = here$c;
        two[$c] = one[$c];
        one[$c] = here$c;
//:end
    }
}

