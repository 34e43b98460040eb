-- title: Declared links
-- description: Every declared link (annotation) and what it explains: publications, those with a
--     message of every input, links, and how long messages waited in their caches. Entries of kind
--     direct and independent explain no indirect links.
-- grain: one row per annotation
-- variant: suggested BOOLEAN = false  Links that the data suggest, in place of those declared
-- column: run_id
-- column: kind VARCHAR              'periodic_async', 'partial_sync', 'approximate_sync', 'direct'
--     or 'independent'
-- column: source VARCHAR            'trace' or 'file'
-- column: node VARCHAR [node]  Node that declares it
-- column: inputs VARCHAR [topic]  Topics of its inputs
-- column: outputs VARCHAR [topic]  Topics of its outputs
-- column: publications BIGINT       Publications that it explains, in the time window
-- column: complete BIGINT           Those with a message of every input
-- column: links BIGINT              Indirect links to them
-- column: ambiguous
-- column: median_wait_ns BIGINT [ns]  Median time from the end of the input's callback to the
--     publication
-- column: max_wait_ns BIGINT [ns]   Longest
-- column: annotation_id BIGINT      Identity of the annotation
-- brief: node, kind, inputs, outputs, publications, complete, links, median_wait_ns, max_wait_ns,
--     ambiguous, source
WITH input AS (
    SELECT
        i.annotation_id,
        string_agg(coalesce(s.topic_name, '?'), ', ' ORDER BY s.topic_name, s.subscription_id)
            AS topics,
        min(s.node_id) AS node_id
    FROM main.annotation_input AS i
    JOIN main.subscription AS s ON i.subscription_id = s.subscription_id
    GROUP BY i.annotation_id
),
output AS (
    SELECT
        o.annotation_id,
        string_agg(coalesce(p.topic_name, '?'), ', ' ORDER BY p.topic_name, p.publisher_id)
            AS topics,
        min(p.node_id) AS node_id
    FROM main.annotation_output AS o
    JOIN main.publisher AS p ON o.publisher_id = p.publisher_id
    GROUP BY o.annotation_id
),
published AS (
    SELECT publication_id
    FROM main.publication
    WHERE list_contains($runs, run_id) AND start_ns >= $start_ns AND start_ns < $end_ns
),
firing AS (
    SELECT
        f.annotation_id,
        count(*) AS publications,
        count(*) FILTER (WHERE f.is_complete) AS complete
    FROM main.annotation_firing AS f
    JOIN published AS b ON f.publication_id = b.publication_id
    GROUP BY f.annotation_id
),
link AS (
    SELECT
        l.annotation_id,
        count(*) AS links,
        count(*) FILTER (WHERE l.candidate_count > 1) AS ambiguous,
        quantile_disc(l.wait_ns, 0.5) AS median_wait_ns,
        max(l.wait_ns) AS max_wait_ns
    FROM main.link_causal AS l
    JOIN published AS b ON l.publication_id = b.publication_id
    WHERE l.annotation_id IS NOT NULL
    GROUP BY l.annotation_id
)
SELECT
    a.run_id, a.kind, a.source,
    main.node_label(n.full_name, p.name, p.pid) AS node,
    i.topics AS inputs,
    o.topics AS outputs,
    coalesce(COLUMNS(['publications', 'complete', 'links', 'ambiguous']), 0),
    l.median_wait_ns, l.max_wait_ns, a.annotation_id
FROM main.annotation AS a
JOIN main.process AS p ON a.process_id = p.process_id
LEFT JOIN input AS i ON a.annotation_id = i.annotation_id
LEFT JOIN output AS o ON a.annotation_id = o.annotation_id
LEFT JOIN main.node AS n ON coalesce(o.node_id, i.node_id) = n.node_id
LEFT JOIN firing AS f ON a.annotation_id = f.annotation_id
LEFT JOIN link AS l ON a.annotation_id = l.annotation_id
WHERE list_contains($runs, a.run_id)
ORDER BY a.run_id, node, a.kind, a.annotation_id
