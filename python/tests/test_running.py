"""Threads, forks, Ctrl-C, GPUs and the command."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import faircurve as fc

CURVES = np.random.default_rng(11).normal(size=(2000, 12, 2))


def fitted(seed):
    return fc.Smoothing(lam=0.1).fit(CURVES + seed % 2).sample(20).tobytes()


def test_eight_threads_at_once_give_the_same_bits():
    alone = [fitted(0), fitted(1)]
    with ThreadPoolExecutor(8) as pool:
        for seed, bits in enumerate(pool.map(fitted, range(32))):
            assert bits == alone[seed % 2]


def _in_child(queue, device):
    try:
        queue.put(fc.Natural().fit(CURVES, device=device).sample(20).tobytes())
    except RuntimeError as error:
        queue.put(str(error))


def forked(device):
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_in_child, args=(queue, device))
    child.start()
    result = queue.get(timeout=60)
    child.join(60)
    assert child.exitcode == 0
    return result


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_fits_on_the_cpu_with_the_same_bits():
    here = fc.Natural().fit(CURVES).sample(20).tobytes()
    assert forked("cpu") == here


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.skipif("FAIRCURVE_REQUIRE_GPU" not in os.environ and not fc.adapters(), reason="no GPU")
def test_a_gpu_gives_the_cpus_curves_and_says_a_sentence_after_a_fork():
    fit = fc.Natural().fit(CURVES, device="gpu", precision="f64")
    assert "CPU" not in fit.device
    assert np.abs(fit.sample(20) - fc.Natural().fit(CURVES, device="cpu").sample(20)).max() < 1e-10
    assert "a GPU was opened before this process was forked" in forked("gpu")
    assert forked("cpu") == fc.Natural().fit(CURVES, device="cpu").sample(20).tobytes()


def test_nothing_but_faircurve_says_anything_while_gpus_are_looked_for():
    program = (
        "import faircurve as fc\n"
        "fc.adapters()\n"
        "curves = [[(0, 0), (2, 1), (3, 0)]] * 20000\n"
        "for device in ('auto', 'gpu'):\n"
        "    try:\n"
        "        fc.Natural().fit(curves, device=device)\n"
        "    except RuntimeError:\n"
        "        pass\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
    said = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, check=True).stderr
    assert said == b""


def test_ctrl_c_ends_a_long_fit():
    program = (
        "import signal, numpy as np, faircurve as fc\n"
        # A shell that runs the tests in the background has Ctrl-C ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "c = np.random.default_rng(0).normal(size=(200_000, 40, 2))\n"
        "print('ready', flush=True)\n"
        "try:\n"
        "    fc.Smoothing(deviation=0.2).fit(c, device='cpu')\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted', flush=True)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(1)
    child.send_signal(signal.SIGINT)
    start = time.monotonic()
    assert child.communicate(timeout=60)[0] == "interrupted\n" and child.returncode == 0
    assert time.monotonic() - start < 30


def test_progress_counts_curves_and_may_end_the_fit():
    curves = np.random.default_rng(0).normal(size=(2000, 40, 2))
    seen = []
    with fc.progress(lambda done, all: seen.append((done, all))):
        fc.Smoothing(tube=0.2).fit(curves, device="cpu")
    assert seen and all(0 <= done <= all == 2000 for done, all in seen) and seen == sorted(seen)

    def enough(done, all):
        raise StopIteration(f"{done} of {all}")

    with pytest.raises(StopIteration), fc.progress(enough):
        fc.Smoothing(tube=0.2).fit(curves, device="cpu")
    fc.Natural().fit(curves)


def test_the_number_of_threads_changes_no_bit():
    curves = np.random.default_rng(0).normal(size=(500, 20, 2))
    cores = fc.num_threads()
    samples = []
    for threads in (1, 3, 0):
        fc.set_num_threads(threads)
        assert fc.num_threads() == (threads or cores)
        samples.append(fc.Fair().fit(curves).sample(50))
    assert np.array_equal(samples[0], samples[1]) and np.array_equal(samples[0], samples[2])
    with pytest.raises(ValueError, match="threads is -1"):
        fc.set_num_threads(-1)


def test_the_command_is_the_program(tmp_path):
    (tmp_path / "in.csv").write_text("curve,x,y\na,0,0\na,1,1\na,2,0\n")
    command = [sys.executable, "-m", "faircurve._command", "fit", "in.csv", "-o", "out.csv", "--samples", "4"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and len((tmp_path / "out.csv").read_text().splitlines()) == 10, done.stderr
    again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert again.returncode == 2 and "out.csv exists already" in again.stderr
