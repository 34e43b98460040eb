-- title: What kept the callbacks of a path waiting
-- description: Rows of waits --by pair, of callbacks on the path that is explained.
-- grain: one row per callback and what it waited for, three at most
-- reads: waits
-- param: callbacks VARCHAR[][]  Node of each, and what triggers it
FROM waits
WHERE list_contains($callbacks, [node, callback])
LIMIT 3
