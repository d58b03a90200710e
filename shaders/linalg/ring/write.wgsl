fn $NAME(place: u32, x: columns) {
    let k = place * params.columns + params.column;
//:if $R == 1
    $ARRAY[k] = x;
//:else
//:unroll c 0..$R
    $ARRAY[k + $cu] = x[$c];
//:end
//:end
}
