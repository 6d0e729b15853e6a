#!/bin/busybox sh
# SPDX-License-Identifier: BSD-3-Clause
# The first process of the guest (run.sh): loads the drivers, runs the tests, says how they ended.
busybox=/bin/busybox
$busybox mount -t proc none /proc
$busybox mount -t sysfs none /sys
$busybox mount -t devtmpfs none /dev
$busybox mount -t tmpfs none /tmp
while read -r module; do
  case $module in
    # One webcam input, no other nodes; no second of pretended USB delay.
    vivid.ko) parameters="n_devs=1 node_types=0x1 num_inputs=1 input_types=0" ;;
    *) parameters="" ;;
  esac
  $busybox insmod "/modules/$module" $parameters || echo "no module $module"
done < /modules/order
for word in $($busybox cat /proc/cmdline); do
  case $word in filter=*) filter=${word#filter=} ;; esac
done
echo "ORBITFUSE-GUEST-BEGIN"
LD_LIBRARY_PATH=/lib/x86_64-linux-gnu:/usr/lib/x86_64-linux-gnu /test --gtest_color=no --gtest_filter="$filter"
echo "ORBITFUSE-GUEST-RESULT $?"
$busybox poweroff -f
