// States say only what has changed since the one before.

/** An object after changes: a field that they do not name is as before, and so in objects within. */
export function changed(before, changes) {
  const fields = Object.entries(changes).map(([name, value]) => {
    const isInside = isObject(value) && isObject(before?.[name]);
    return [name, isInside ? changed(before[name], value) : value];
  });
  return { ...before, ...Object.fromEntries(fields) };
}

const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
