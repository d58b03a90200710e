"""Shorelines, rivers and borders of the world (Debian gmt-gshhg-*, LGPL-3+), longitude and latitude in degrees.

The binned files hold, for every bin of some degrees, segments of points as 16-bit fractions of the bin.

usage: gshhg.py BINNED.nc OUT.npz
"""

import sys

import netCDF4
import numpy as np
from ragged import save_flat

source, out = sys.argv[1:]
data = netCDF4.Dataset(source)
data.set_auto_mask(False)
bin_degrees = int(data["Bin_size_in_minutes"][0]) / 60
bins_around = int(data["N_bins_in_360_longitude_range"][0])
segments_of_bin = data["N_segments_in_a_bin"][:].astype(int)
# Stored as signed 16-bit numbers, meant unsigned.
dx = data["Relative_longitude_from_SW_corner_of_bin"][:].astype("i8") & 0xFFFF
dy = data["Relative_latitude_from_SW_corner_of_bin"][:].astype("i8") & 0xFFFF
offsets = np.append(data["Id_of_first_point_in_a_segment"][:], len(dx)).astype(np.int64)
bin_of_segment = np.repeat(np.arange(len(segments_of_bin)), segments_of_bin)
bin_of_point = np.repeat(bin_of_segment, np.diff(offsets))
longitude = (bin_of_point % bins_around) * bin_degrees + dx * bin_degrees / 65535
latitude = 90 - (bin_of_point // bins_around + 1) * bin_degrees + dy * bin_degrees / 65535
# By the bin's own side of 180°, so that no segment that touches ±180 jumps from one to the other.
longitude -= np.where((bin_of_point % bins_around) * bin_degrees >= 180, 360, 0)
save_flat(out, np.stack([longitude, latitude], axis=1), offsets)
