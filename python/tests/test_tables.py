"""FairBatch: tables in and out, alone and spread over processes."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

import faircurve as fc

pa = pytest.importorskip("pyarrow")

POINT = pa.list_(pa.list_(pa.float64(), 2))


def table(count, seed=0):
    """Strokes of 3 to 12 points, some of them bad."""
    random = np.random.default_rng(seed)
    lines = [random.normal(size=(random.integers(3, 13), 2)).cumsum(axis=0).tolist() for _ in range(count)]
    for k in range(0, count, 97):
        lines[k] = [[float("nan"), 0.0], [1.0, 1.0]]
    return pa.table({"id": np.arange(count), "points": pa.array(lines, POINT)})


def bits(made):
    """A table or a column as something that is equal where every bit is, NaN too."""
    if isinstance(made, pa.Table):
        return {name: bits(made[name]) for name in made.column_names}
    column = made.combine_chunks() if isinstance(made, pa.ChunkedArray) else made
    if not pa.types.is_nested(column.type):
        return np.array(column.to_pylist()).tobytes() if pa.types.is_floating(column.type) else column.to_pylist()
    return [np.array(line, float).tobytes() for line in column.to_pylist()]


FAIR = fc.FairBatch(fc.Smoothing(lam=0.1), samples={"count": 16}, device="cpu")


def test_tables_keep_their_rows_and_gain_columns():
    given = table(300)
    made = FAIR(given)
    assert made.column_names == ["id", "points", *(f"fair_{name}" for name in ("points", "status", "message", "energy", "iterations", "max_deviation"))]
    assert bits(made["id"]) == bits(given["id"]) and made.schema.field("fair_points").type == POINT
    assert made["fair_status"].to_pylist().count("invalid") == 4
    samples = fc.Smoothing(lam=0.1).fit(given["points"], device="cpu").sample(16)
    assert bits(made["fair_points"]) == bits(samples) and bits(made["points"]) == bits(given["points"])
    plain = fc.FairBatch(fc.Natural(), prefix="my_", report=False)
    assert plain(given).column_names == ["id", "points", "my_points"]
    with pytest.raises(ValueError, match='the table has a column "my_points" already: give another prefix'):
        plain(plain(given))
    with pytest.raises(TypeError, match="method is 'natural'; it must have a fit"):
        fc.FairBatch("natural")
    with pytest.raises(ValueError, match="samples is {'cnt': 5}; it must be one of count, per_span"):
        fc.FairBatch(fc.Natural(), samples={"cnt": 5})
    with pytest.raises(ValueError, match='there is no column "line": the table has id, points'):
        fc.FairBatch(fc.Natural(), "line")(given)


def test_parts_of_a_table_make_the_parts_of_the_result_to_the_bit():
    given = table(300)
    whole = FAIR(given)
    copied = pickle.loads(pickle.dumps(FAIR))
    parts = [copied(given.slice(k, 70)) for k in range(0, 300, 70)]
    assert bits(pa.concat_tables(parts)) == bits(whole)
    batches = [FAIR(batch) for batch in given.to_batches(max_chunksize=41)]
    assert bits(pa.concat_tables(batches)) == bits(whole)
    empty = FAIR(given.slice(0, 0))
    # Spark has no unsigned numbers.
    assert not any(pa.types.is_unsigned_integer(column.type) for column in empty.schema)
    assert empty.num_rows == 0 and empty.schema == whole.schema == FAIR.schema(given.schema)


def test_parameters_may_be_a_column():
    given = table(20, seed=3)
    t = [np.arange(len(line), dtype=float).tolist() for line in given["points"].to_pylist()]
    made = fc.FairBatch(fc.Natural(), t="t", samples={"per_span": 4})(given.append_column("t", pa.array(t)))
    samples, times = fc.Natural().fit(given["points"], t=t).sample(per_span=4, return_t=True)
    assert bits(made["fair_points"]) == bits(samples) and made["t"].to_pylist() == t
    assert made["fair_t"].to_pylist() == [own.tolist() for own in times]


def test_polars_gives_the_bits_of_one_table():
    pl = pytest.importorskip("polars")
    given = table(300)
    frame, whole = pl.from_arrow(given), pl.from_arrow(FAIR(given))
    fair = lambda part: pl.from_arrow(FAIR(part.to_arrow()))
    parts = pl.concat([fair(part) for part in frame.iter_slices(70)])
    lazy = frame.lazy().map_batches(fair, schema=fair(frame[:0]).schema).filter(pl.col("fair_status") == "converged")
    assert bits(parts.to_arrow()) == bits(whole.to_arrow()) and len(lazy.collect()) == 296


DASK = """
import os, signal, sys, threading, time
import dask, pandas as pd, pyarrow as pa, pyarrow.parquet as pq
import dask.dataframe as dd
from distributed import Client, LocalCluster, get_worker
sys.path.insert(0, sys.argv[1])
from test_tables import FAIR, bits, table

def slow(frame):
    time.sleep(0.3)
    return FAIR.pandas(frame)

if __name__ == "__main__":
    dask.config.set({"distributed.worker.daemon": True})
    given = table(2000, seed=5)
    frame = given.to_pandas(types_mapper=pd.ArrowDtype)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster, Client(cluster) as client:
        pids = client.run(os.getpid)
        victim = sorted(pids.values())[0]
        killer = threading.Timer(1.5, os.kill, (victim, signal.SIGKILL))
        killer.start()
        parts = dd.from_pandas(frame, npartitions=20).map_partitions(slow, meta=FAIR.pandas(frame.iloc[:0]))
        made = parts.compute()
        assert victim not in client.run(os.getpid).values(), "the worker was killed"
    whole = FAIR(given)
    result = pa.Table.from_pandas(made, preserve_index=False)
    assert made.index.tolist() == list(range(2000)), made.index
    for name in whole.column_names:
        assert bits(result[name]) == bits(whole[name]), name
    print("same bits")
"""


def test_dask_with_a_worker_killed_on_the_way_gives_the_bits_of_one_process(tmp_path):
    pytest.importorskip("distributed")
    pytest.importorskip("dask.dataframe")
    script = tmp_path / "spread.py"
    script.write_text(DASK)
    done = subprocess.run(
        [sys.executable, str(script), os.path.dirname(__file__)], capture_output=True, text=True, timeout=240, cwd=tmp_path
    )
    assert "same bits" in done.stdout, done.stdout + done.stderr[-3000:]
