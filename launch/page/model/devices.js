// Devices that can break, as the run declares them.

/** Those that a robot has: `[{name, label, tells_lengths, tells_heading}]`. */
export function devicesOf({ devices, scenario }, rank) {
  const { side_sensor, devices: own = [] } = scenario.robots[rank];
  const has = ({ name }) => own.includes(name) || (side_sensor && name === "side-border");
  return devices.filter((device) => !device.is_optional || has(device));
}
