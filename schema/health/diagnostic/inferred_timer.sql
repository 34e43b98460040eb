-- name: diagnostic.inferred_timer
-- title: Timers that were not seen to be created
-- description: Timers were used whose creation is not in the trace. What they are called is not
--     known, or deduced.
-- finding: started_late
-- grain: one row, if there are any
-- severity: warning
-- phase: model
SELECT NULL AS trace_id, count, detail
FROM unseen_object
WHERE kind = 'timer'
