"""Binary tables: TDMS, MAT, HDF5, Parquet and Feather files enter, their columns leave."""
