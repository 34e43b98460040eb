-- kind: inline
-- description: Symbols of callbacks, which slices refer to by number.
-- grain: one row per callback with a symbol
SELECT callback_id AS id, symbol AS name
FROM main.callback
WHERE run_id = $run_id AND symbol IS NOT NULL
ORDER BY id
