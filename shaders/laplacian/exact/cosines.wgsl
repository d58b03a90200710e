// Every second value times its cosine, from the last of them backwards: spectra die away, and small
// numbers come first. Blocks keep the roundings few.
fn $NAME_of(last: u32, stride: u32, count: u32, table: u32, period: u32, last_angle: u32, step: u32) -> real {
    var sum = real(0);
    var place = last;
    var angle = last_angle;
    var left = count;
    while (left > 0u) {
        var part = real(0);
        for (var k = min(left, 8u); k > 0u; k--) {
            part += $ARRAY[place] * tables[table + angle];
            place -= stride;
            angle += select(period, 0u, angle >= step) - step;
            left--;
        }
        sum += part;
    }
    return sum;
}

// The sums of a cosine transform over the even and over the odd ones of `count` + 1 values, the
// first and the last at half weight: their sum is the number of a frequency, their difference that
// of the frequency `count` less it. `step` is the frequency's, in places of the table.
fn $NAME(first: u32, stride: u32, count: u32, table: u32, period: u32, step: u32) -> vec2<real> {
    let last = real(0.5) * $ARRAY[first + count * stride] * tables[table + count * step % period];
    let evens = (count - 1u) / 2u;
    let odds = count / 2u;
    let twice = 2u * step % period;
    var even = $NAME_of(first + 2u * evens * stride, 2u * stride, evens, table, period, evens * twice % period, twice);
    even += real(0.5) * $ARRAY[first];
    // Below 0 it stops.
    let last_odd = 2u * max(odds, 1u) - 1u;
    var odd = $NAME_of(first + last_odd * stride, 2u * stride, odds, table, period, last_odd * step % period, twice);
    if (count % 2u == 0u) {
        even += last;
    } else {
        odd += last;
    }
    return vec2<real>(even, odd);
}
