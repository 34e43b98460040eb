-- name: diagnostic.check_failed
-- title: An audit failed
-- description: Rows of the run break a rule that must hold in every database.
-- finding: audit_failed
-- grain: one row per audit
-- severity: error
-- phase: database
-- param: failed STRUCT[]  Name, row count and description of the audits that failed
SELECT
    NULL AS trace_id,
    audit.row_count AS count,
    printf('%s: %s', audit.name, audit.description) AS detail
FROM (
    SELECT unnest($failed::STRUCT(name VARCHAR, row_count BIGINT, description VARCHAR)[]) AS audit
)
