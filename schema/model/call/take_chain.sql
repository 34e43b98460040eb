-- name: staging.take_chain
-- kind: inline
-- description: All takes that were successful, the whole ones and the rest.
-- grain: one row per successful take or dequeue
FROM staging.take_whole
UNION ALL
FROM staging.take_rest
