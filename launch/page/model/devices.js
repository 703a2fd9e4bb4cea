// Devices that can fail, as the run declares them.

/** Returns the devices of a robot: `[{name, label, tells_lengths, tells_heading}]`. */
export function devicesOf({ devices, scenario }, rank) {
  const { side_sensor, devices: declared = [] } = scenario.robots[rank];
  const has = ({ name }) => declared.includes(name) || (side_sensor && name === "side-border");
  return devices.filter((device) => !device.is_optional || has(device));
}
