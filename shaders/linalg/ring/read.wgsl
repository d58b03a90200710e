fn $NAME(place: u32) -> columns {
    let k = place * params.columns + params.column;
//:if $R == 1
    return $ARRAY[k];
//:else
    var x: columns;
//:unroll c 0..$R
    x[$c] = $ARRAY[k + $cu];
//:end
    return x;
//:end
}
