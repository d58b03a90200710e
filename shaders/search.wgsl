// The last index from `first` on, below `end`, at which $AT, ascending in `middle`, is at most `value`;
// else `first`. No twin: the CPU takes curve after curve.
fn $NAME(first: u32, end: u32, value: u32) -> u32 {
    var low = first;
    var high = end;
    while (high - low > 1u) {
        let middle = (low + high) / 2u;
        if ($AT <= value) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}
