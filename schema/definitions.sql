-- Views, macros, tables, triggers and types of the current database, each with its definition as
-- DuckDB prints it. Keys are left out: their place in the statement differs, and they hold no SQL.
SELECT
    'view ' || schema_name || '.' || view_name AS name,
    sql
FROM duckdb_views()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
UNION ALL
SELECT
    'macro ' || schema_name || '.' || function_name,
    string_agg(
        concat_ws(chr(0), function_type, parameters::VARCHAR, macro_definition), chr(0)
        ORDER BY function_type, parameters::VARCHAR, macro_definition
    )
FROM duckdb_functions()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
GROUP BY schema_name, function_name
UNION ALL
SELECT
    'table ' || schema_name || '.' || table_name,
    regexp_replace(sql, ',? PRIMARY KEY(\([^)]*\))?', '', 'g')
FROM duckdb_tables()
WHERE database_name = current_database() AND schema_name IN ('store', 'main', 'derive')
    AND table_name <> 'alembic_version'
UNION ALL
SELECT
    'type ' || schema_name || '.' || type_name,
    ''
FROM duckdb_types()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
